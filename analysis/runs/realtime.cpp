#include "analysis/runs/realtime.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "analysis/runs/overrides.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/stopwatch.hpp"
#include "kernel/api/partition.hpp"
#include "models/options/run_stages.hpp"

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

bool is_virtual(const scenarios::Scenario& scenario) {
  return scenario.run.executor == models::ExecutorKind::kVirtual;
}

bool has_time_warp(const scenarios::Scenario& scenario) {
  return models::executor_of(scenario.run, scenario.territory.worlds) !=
         models::ExecutorKind::kSequential;
}

// Who executes which world.
kernel::Partition workers_of(const scenarios::Scenario& scenario) {
  const std::uint32_t worlds = scenario.territory.worlds;
  unsigned workers = has_time_warp(scenario) ? scenario.run.threads : 1;
  if (is_virtual(scenario)) workers = scenario.run.cluster.processors;
  return {worlds, std::min<std::size_t>(workers, worlds)};
}

// Of a world, such that a load of 1 keeps the workers busy that have the most worlds.
double share_s(const RealTimeReport& report, const kernel::Partition& workers) {
  const double step_s = report.playback.frame_s / report.playback.steps_per_frame;
  const std::size_t most = (workers.lps + workers.workers - 1) / workers.workers;
  return step_s / static_cast<double>(most);
}

RealTimeReport plan_of(const RealTimeRequest& request, const scenarios::Scenario& scenario) {
  const models::RunOptions& run = scenario.run;
  RealTimeReport report;
  report.request = request;
  report.buffer = run.buffer;
  report.playback = {
      .frame_s = 1.0 / request.frames_per_s,
      .steps_per_frame = request.speed / (request.frames_per_s * scenario.scene.dt_s),
      .steps = run.steps,
      .first_step = run.first_step};
  const auto most = static_cast<std::int64_t>(std::ceil(report.playback.steps_per_frame));
  const bool at_once = is_virtual(scenario) && run.cluster.gvt_delay_ns == 0;
  report.lead.steps = std::max(most, run.buffer);
  if (has_time_warp(scenario)) {
    const std::int64_t frames =
        at_once ? 1 : static_cast<std::int64_t>(request.lead_frames.value_or(kUsualLeadFrames));
    report.lead.steps = frames * most;
    const bool adapts = !is_virtual(scenario) && !request.lead_frames;
    report.lead.frame = adapts ? most : 0;
  }
  report.lead.most = std::max(report.lead.steps, run.buffer);
  report.most_lead = report.lead.steps;
  return report;
}

}  // namespace

void require_paceable(const models::RunOptions& run) {
  if (run.executor == models::ExecutorKind::kMpi)
    throw UsageError(std::string("--realtime: found executor ") + name_of(run.executor) +
                     "; allowed: sequential, threads, virtual");
  if (run.executor == models::ExecutorKind::kVirtual &&
      run.synchronisation == kernel::Synchronisation::kLockstep)
    throw UsageError("--realtime: the virtual clock does not pace lockstep");
}

models::ArtificialLoad load_of(const RealTimeRequest& request) {
  models::ArtificialLoad load{.base = request.load};
  if (request.peak > 0.0)
    load.peaks.push_back({{}, request.peak_from_s, request.peak_for_s, request.peak});
  return load;
}

// Spends CPU time before an entry counts as written.
class RealTimeSession::Load final : public models::EntryObserver {
 public:
  Load(const models::ArtificialLoad& load, double share_s, const kernel::Partition& workers,
       std::int64_t first_step, models::EntryObserver& next)
      : load_(load),
        share_s_(share_s),
        workers_(workers),
        next_(next),
        last_(workers.lps, first_step),
        work_(workers.workers) {}

  void on_newest(models::WorldId world, std::int64_t step) override {
    std::int64_t& last = last_[models::index_of(world)];
    if (step > last) {  // written, not gone back to
      spend(share_s_ * models::load_of(load_, world, since_s()));
      work_[workers_.owner_of(kernel::LpId{models::index_of(world)})].push_back(
          {since_s(), thread_cpu_s()});
    }
    last = step;
    next_.on_newest(world, step);
  }
  std::vector<std::vector<models::WorkMark>> take_work() { return std::move(work_); }
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
  double since_s() const {
    const std::int64_t first = first_frame_ns_.load();
    return first > 0 ? 1e-9 * static_cast<double>(clock_ns() - first) : -1.0;
  }

  const models::ArtificialLoad load_;
  const double share_s_;
  const kernel::Partition workers_;
  models::EntryObserver& next_;
  // Of each world, and of each thread: touched by the thread that executes it.
  std::vector<std::int64_t> last_;
  std::vector<std::vector<models::WorkMark>> work_;
  std::atomic<std::int64_t> first_frame_ns_{0};
};

RealTimeSession::RealTimeSession(const RealTimeRequest& request, const models::ArtificialLoad& load,
                                 const scenarios::Scenario& scenario)
    : report_(plan_of(request, scenario)),
      buffer_(scenario.initial, scenario.territory.worlds, report_.lead, scenario.run.first_step) {
  const kernel::Partition workers = workers_of(scenario);
  const double world_s = share_s(report_, workers);
  if (is_virtual(scenario))
    by_virtual_ = std::make_unique<models::VirtualPlayback>(
        buffer_, report_.playback, report_.buffer, load, workers, 1e9 * world_s);
  else
    load_ = std::make_unique<Load>(load, world_s, workers, scenario.run.first_step, buffer_);
}

RealTimeSession::~RealTimeSession() {
  run_ended_ = true;
  if (renderer_.joinable()) renderer_.join();
}

models::RunOptions RealTimeSession::paced(const models::RunOptions& run) {
  models::RunOptions options = run;
  options.outsides.push_back(&buffer_);
  options.entries = load_.get();
  if (!by_virtual_) return options;
  options.entries = by_virtual_.get();
  options.cluster.clock_user = by_virtual_.get();
  options.event_cost_ns = [this](models::WorldId world, std::int64_t own_ns) {
    return by_virtual_->event_cost_ns(world, own_ns);
  };
  return options;
}

void RealTimeSession::start() {
  if (by_virtual_) return;
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
  if (by_virtual_) {
    by_virtual_->finish();
    report_.frames = by_virtual_->frames();
    report_.work = by_virtual_->work();
  } else {
    renderer_.join();
    report_.work = load_->take_work();
  }
  report_.most_lead = buffer_.most_lead_steps();
  report_.summary = models::summary_of(report_.frames, report_.playback);
  return std::move(report_);
}

}  // namespace soda::analysis
