#include "analysis/realtime.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "analysis/exit_codes.hpp"
#include "analysis/overrides.hpp"
#include "analysis/stopwatch.hpp"

namespace soda::analysis {
namespace {

class WallClock final : public models::Clock {
 public:
  double now_s() const override {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  void sleep_until(double time_s) override {
    std::this_thread::sleep_until(start_ + std::chrono::duration_cast<Steady::duration>(
                                               std::chrono::duration<double>(time_s)));
    worst_wake_s_ = std::max(worst_wake_s_, now_s() - time_s);
  }
  double worst_wake_s() const { return worst_wake_s_; }

 private:
  using Steady = std::chrono::steady_clock;
  const Steady::time_point start_ = Steady::now();
  double worst_wake_s_ = 0.0;
};

// How far GVT may be beyond what is shown. With one, a frame is late when a GVT round takes longer
// than a frame, though the buffer is full: seen on a machine with six programs a processor.
constexpr std::int64_t kFramesBeyond = 2;

bool has_time_warp(const scenarios::Scenario& scenario) {
  return scenario.run.executor != models::ExecutorKind::kSequential &&
         scenario.territory.worlds > 1;
}

RealTimeReport plan_of(const RealTimeRequest& request, const scenarios::Scenario& scenario) {
  const models::RunOptions& run = scenario.run;
  RealTimeReport report;
  report.request = request;
  report.buffer = run.buffer;
  report.playback = {
      .frame_s = 1.0 / request.frames_per_s,
      .steps_per_frame = request.speed / (request.frames_per_s * scenario.scene.dt_s),
      .steps = run.steps};
  const auto most = static_cast<std::int64_t>(std::ceil(report.playback.steps_per_frame));
  report.lead = has_time_warp(scenario) ? kFramesBeyond * most : std::max(most, run.buffer);
  return report;
}

}  // namespace

void require_paceable(const models::RunOptions& run) {
  if (run.executor != models::ExecutorKind::kSequential &&
      run.executor != models::ExecutorKind::kThreads)
    throw UsageError(std::string("--realtime: found executor ") + name_of(run.executor) +
                     "; allowed: sequential, threads");
}

// Spends CPU time before an entry counts as written. A world's share is what keeps all threads as
// busy as one that did all of it.
class RealTimeSession::Load final : public models::EntryObserver {
 public:
  Load(const ArtificialLoad& load, const RealTimeReport& report,
       const scenarios::Scenario& scenario, models::EntryObserver& next)
      : load_(load), next_(next), last_(scenario.territory.worlds, 0) {
    const bool in_parallel = has_time_warp(scenario);
    const double step_s = report.playback.frame_s / report.playback.steps_per_frame;
    share_s_ = step_s * (in_parallel ? scenario.run.threads : 1u) / scenario.territory.worlds;
  }

  void on_newest(models::WorldId world, std::int64_t step) override {
    std::int64_t& last = last_[models::index_of(world)];
    if (step > last) spend(share_s_ * now());  // written, not gone back to
    last = step;
    next_.on_newest(world, step);
  }
  void first_frame_follows() { first_frame_ns_.store(clock_ns()); }

 private:
  static void spend(double cpu_s) {
    if (cpu_s <= 0.0) return;
    const double end_s = thread_cpu_s() + cpu_s;
    while (thread_cpu_s() < end_s) {
    }
  }
  static std::int64_t clock_ns() {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  }
  double now() const {
    const std::int64_t first = first_frame_ns_.load();
    const double since_s = 1e-9 * static_cast<double>(clock_ns() - first);
    const bool peak = first > 0 && load_.peak > 0.0 && since_s >= load_.peak_from_s &&
                      since_s < load_.peak_from_s + load_.peak_for_s;
    return peak ? load_.peak : load_.base;
  }

  const ArtificialLoad load_;
  models::EntryObserver& next_;
  std::vector<std::int64_t> last_;  // of each world, touched by the thread that executes it
  double share_s_ = 0.0;
  std::atomic<std::int64_t> first_frame_ns_{0};
};

RealTimeSession::RealTimeSession(const RealTimeRequest& request,
                                 const scenarios::Scenario& scenario)
    : report_(plan_of(request, scenario)),
      buffer_(scenario.initial, scenario.territory.worlds, report_.lead),
      load_(std::make_unique<Load>(request.load, report_, scenario, buffer_)) {}

RealTimeSession::~RealTimeSession() {
  run_ended_ = true;
  if (renderer_.joinable()) renderer_.join();
}

models::RunOptions RealTimeSession::paced(const models::RunOptions& run) {
  models::RunOptions options = run;
  options.outsides.push_back(&buffer_);
  options.entries = load_.get();
  return options;
}

void RealTimeSession::start() {
  renderer_ = std::thread([this] {
    WallClock clock;
    const models::Playback playback = models::play(
        buffer_, report_.playback, clock, report_.buffer, [this] { return run_ended_.load(); },
        [this] { load_->first_frame_follows(); });
    report_.frames = playback.frames();
    report_.worst_wake_s = clock.worst_wake_s();
  });
}

RealTimeReport RealTimeSession::finish() {
  run_ended_ = true;
  renderer_.join();
  report_.summary = models::summary_of(report_.frames, report_.playback);
  return std::move(report_);
}

}  // namespace soda::analysis
