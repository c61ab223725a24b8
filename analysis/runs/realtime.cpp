#include "analysis/runs/realtime.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "analysis/text/exit_codes.hpp"
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

// Beyond GVT, so that what GVT may not pass bounds nothing that is in store.
bool runs_ahead(const scenarios::Scenario& scenario) {
  return has_time_warp(scenario) &&
         scenario.run.synchronisation == kernel::Synchronisation::kOptimistic;
}

// The other ranks; null without any.
const kernel::Transport* job_of(const scenarios::Scenario& scenario) {
  return scenario.run.executor == models::ExecutorKind::kMpi ? scenario.run.transport : nullptr;
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
  if (runs_ahead(scenario)) {
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

kernel::Partition workers_of(const scenarios::Scenario& scenario) {
  const std::uint32_t worlds = scenario.territory.worlds;
  const models::RunOptions& run = scenario.run;
  if (is_virtual(scenario)) return {worlds, std::min<std::size_t>(run.cluster.processors, worlds)};
  if (!has_time_warp(scenario)) return {worlds, 1};
  if (const kernel::Transport* job = job_of(scenario))
    return {worlds, std::size_t{run.threads} * job->size()};
  return {worlds, std::min<std::size_t>(run.threads, worlds)};
}

void require_paceable(const models::RunOptions& run) {
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

RealTimeSession::RealTimeSession(const RealTimeRequest& request, const models::ArtificialLoad& load,
                                 const scenarios::Scenario& scenario)
    : is_root_(job_of(scenario) == nullptr || job_of(scenario)->is_root()),
      report_(plan_of(request, scenario)),
      buffer_(scenario.initial, scenario.territory.worlds, report_.lead, scenario.run.first_step) {
  const kernel::Partition workers = workers_of(scenario);
  const double world_s = share_s(report_, workers);
  if (is_virtual(scenario))
    by_virtual_ = std::make_unique<models::VirtualPlayback>(
        buffer_, report_.playback, report_.buffer, load, workers, 1e9 * world_s);
  else
    load_ = std::make_unique<StepLoad>(load, world_s, workers,
                                       StepLoad::Next{buffer_, scenario.run.first_step}, is_root_);
}

RealTimeSession::~RealTimeSession() {
  run_ended_ = true;
  if (renderer_.joinable()) renderer_.join();
}

models::RunOptions RealTimeSession::paced(const models::RunOptions& run) {
  models::RunOptions options = run;
  options.external_sources.push_back(&buffer_);
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
  if (by_virtual_ || !is_root_) return;
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
