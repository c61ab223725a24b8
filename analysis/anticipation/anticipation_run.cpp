#include "analysis/anticipation/anticipation_run.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/runs/measured_run.hpp"
#include "kernel/api/partition.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

// As a ratio of whole numbers gives it, if it was one.
std::int64_t whole(double steps) { return static_cast<std::int64_t>(std::floor(steps + 1e-6)); }

bool is_in_peak(const PeakOptions& peak, std::uint32_t world) {
  return peak.worlds.empty() || std::ranges::count(peak.worlds, models::WorldId{world}) > 0;
}

bool is_root(const scenarios::Scenario& scenario) {
  return scenario.run.executor != models::ExecutorKind::kMpi || scenario.run.transport->is_root();
}

models::ArtificialLoad load_of_run(const AnticipationOptions& options, double overload,
                                   std::uint32_t worlds, double ends_s) {
  const double peak_load = options.utilisation * (1.0 + overload);
  const PeakOptions& peak = options.peak;
  models::ArtificialLoad load{.base = options.utilisation};
  if (peak.wandering)
    load.peaks = models::wandering_peak(worlds, peak_load, ends_s, *peak.wandering);
  else
    load.peaks = {{peak.worlds, peak.from_s, peak.for_s, peak_load}};
  return load;
}

// Steps until the peak, and as many as are to be seen after it.
std::int64_t steps_of_run(const AnticipationOptions& options, double dt_s, std::int64_t law) {
  constexpr std::int64_t kMore = 60;  // so that a run which is not late ends as one
  const double before = options.peak.from_s * options.speed / dt_s;
  if (options.peak.wandering || std::isfinite(options.peak.for_s)) {
    const double peak_s = std::isfinite(options.peak.for_s) ? options.peak.for_s : 0.0;
    return whole(before + peak_s * options.speed / dt_s) + options.max_steps;
  }
  const std::int64_t after = law < 0 ? options.max_steps : std::min(options.max_steps, law + kMore);
  return whole(before) + after;
}

// Mean of a worker's steps between two times, in frames: the largest of all workers. The step in
// which the peak began is in part of the time before.
double largest_ratio(const RealTimeReport& report, const kernel::Partition& workers, double from_s,
                     double to_s) {
  double largest = kNotKnown;
  const double step_s = report.playback.frame_s / report.playback.steps_per_frame;
  for (std::size_t worker = 0; worker < report.work.size(); ++worker) {
    const std::vector<models::WorkMark>& marks = report.work[worker];
    const auto since = [](const models::WorkMark& mark) { return mark.since_s; };
    const auto first = std::ranges::lower_bound(marks, from_s, {}, since);
    const auto last = std::ranges::upper_bound(marks, to_s, {}, since);
    if (last - first < 2) continue;
    const auto entries = static_cast<double>(last - first - 1);
    const auto worlds =
        static_cast<double>(workers.first_of(worker + 1) - workers.first_of(worker));
    const double ratio = ((last - 1)->worked_s - first->worked_s) / entries * worlds / step_s;
    if (!(largest >= ratio)) largest = ratio;
  }
  return largest;
}

double recovery_s(const std::vector<models::ShownFrame>& frames, std::int64_t filled,
                  double ends_s) {
  for (const models::ShownFrame& frame : frames)
    if (frame.due_s >= ends_s && frame.fill >= filled) return frame.due_s - ends_s;
  return kNotKnown;
}

double bytes_of_buffers(const models::WorldCounters& worlds, std::int64_t buffer,
                        std::uint32_t count) {
  if (worlds.entries_stored == 0) return 0.0;
  const auto stored = static_cast<double>(worlds.state_bytes_stored + worlds.memo_bytes_stored);
  return stored / static_cast<double>(worlds.entries_stored) * static_cast<double>(buffer) * count;
}

AnticipationRun outcome_of(const RealTimeReport& report, const MeasuredRun& run,
                           const scenarios::Scenario& scenario,
                           const AnticipationOptions& options) {
  AnticipationRun outcome;
  outcome.frames = report.summary;
  outcome.rolled_back = 1.0 - efficiency(run.result.events);
  outcome.buffer_bytes =
      bytes_of_buffers(run.result.worlds, scenario.run.buffer, scenario.territory.worlds);
  const auto peak = static_cast<std::size_t>(whole(options.peak.from_s * options.frames_per_s));
  const auto on_time = [](const models::ShownFrame& frame) {
    return frame.fate == models::FrameFate::kOnTime;
  };
  const std::vector<models::ShownFrame>& frames = report.frames;
  const auto missing = std::ranges::find_if_not(frames, on_time);
  const auto until = static_cast<std::size_t>(missing - frames.begin());
  outcome.late_before = until <= peak;
  outcome.ratio = outcome.recovery_s = kNotKnown;
  if (outcome.late_before || frames.size() <= peak) return outcome;
  outcome.late = missing != frames.end();
  outcome.filled = frames[peak].fill;
  outcome.steps = frames[until - 1].clock - frames[peak].clock;
  const double ends_s = std::min(frames[until - 1].due_s, options.peak.from_s + options.peak.for_s);
  outcome.ratio = largest_ratio(report, workers_of(scenario), options.peak.from_s, ends_s);
  outcome.law = law_steps(outcome.filled, outcome.ratio);
  if (std::isfinite(options.peak.for_s))
    outcome.recovery_s =
        recovery_s(frames, outcome.filled, options.peak.from_s + options.peak.for_s);
  return outcome;
}

AnticipationRun run_once(const scenarios::Scenario& scenario, const AnticipationOptions& options,
                         double overload) {
  const RealTimeRequest request{.frames_per_s = options.frames_per_s,
                                .speed = options.speed,
                                .lead_frames = options.lead_frames};
  const double ends_s = static_cast<double>(scenario.run.steps) * scenario.scene.dt_s;
  RealTimeSession session(
      request, load_of_run(options, overload, scenario.territory.worlds, ends_s / options.speed),
      scenario);
  models::CommitObserver observer;
  observer.wants_states = true;
  observer.on_step = [&session](const models::CommittedStep& step) { session.add(step); };
  if (!is_root(scenario)) {
    take_part(scenario.scene, scenario.initial, scenario.territory, session.paced(scenario.run),
              observer);
    return {};
  }
  session.start();
  const MeasuredRun run = measure_run(scenario.scene, scenario.initial, scenario.territory,
                                      session.paced(scenario.run), observer, {});
  return outcome_of(session.finish(), run, scenario, options);
}

// As many virtual processors as the run would have threads. GVT costs nothing, so that what is left
// is what the buffers do.
scenarios::Scenario on_virtual_clock(const scenarios::Scenario& scenario,
                                     const AnticipationOptions& options) {
  scenarios::Scenario modelled = scenario;
  models::RunOptions& run = modelled.run;
  if (run.executor != models::ExecutorKind::kVirtual) {
    run.cluster.processors = static_cast<unsigned>(
        std::min<std::size_t>(workers_of(scenario).workers, scenario.territory.worlds));
    run.executor = models::ExecutorKind::kVirtual;
  }
  run.cluster.gvt_delay_ns = 0;
  run.cluster.gvt_interval_ns = static_cast<std::int64_t>(1e9 / options.frames_per_s);
  return modelled;
}

AnticipationRun median_of(std::vector<AnticipationRun> runs) {
  std::ranges::sort(runs, {}, &AnticipationRun::steps);
  return runs[runs.size() / 2];
}

}  // namespace

std::int64_t law_steps(std::int64_t entries, double ratio) {
  if (!(ratio > 1.0)) return -1;
  return whole(models::anticipation_steps(static_cast<double>(entries), ratio));
}

double ratio_of(const scenarios::Scenario& scenario, const AnticipationOptions& options,
                double overload) {
  const kernel::Partition workers = workers_of(scenario);
  double largest = 0.0;
  std::size_t most = 1;
  for (std::size_t worker = 0; worker < workers.workers; ++worker)
    most = std::max(most, workers.first_of(worker + 1) - workers.first_of(worker));
  for (std::size_t worker = 0; worker < workers.workers; ++worker) {
    double sum = 0.0;
    for (std::size_t world = workers.first_of(worker); world < workers.first_of(worker + 1);
         ++world)
      sum += is_in_peak(options.peak, static_cast<std::uint32_t>(world)) ? 1.0 + overload : 1.0;
    largest = std::max(largest, options.utilisation * sum / static_cast<double>(most));
  }
  return largest;
}

scenarios::Scenario idle_scene(std::uint32_t worlds) {
  std::string text =
      R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.016666666666666666,
          "duration_s": 1, "buffer_entries": 48,
          "materials": [{"name": "any", "friction": 0, "restitution": 0}],
          "territory": {"origin_m": [0, 0, 0], "cell_size_m": 2, "cells": [)" +
      std::to_string(worlds) + R"(, 1, 1], "worlds": )" + std::to_string(worlds) +
      R"(, "map": "blocks"}, "bodies": [)";
  for (std::uint32_t world = 0; world < worlds; ++world)
    text += std::string(world == 0 ? "" : ", ") + R"({"id": )" + std::to_string(world) +
            R"(, "shape": {"type": "sphere", "radius_m": 0.1}, "material": "any", "mass_kg": 1,
               "position_m": [)" +
            std::to_string(2 * world + 1) + ", 1, 1]}";
  return scenarios::read_scenario_text(text + "]}", "idle scene");
}

std::vector<AnticipationPoint> anticipation(
    const scenarios::Scenario& scenario, const AnticipationOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress) {
  const std::size_t runs = options.buffers.size() * options.overloads.size();
  std::vector<AnticipationPoint> points;
  for (const std::int64_t buffer : options.buffers)
    for (const double overload : options.overloads) {
      progress(points.size(), runs);
      scenarios::Scenario asked = scenario;
      asked.run.buffer = buffer;
      const double ratio = ratio_of(asked, options, overload);
      AnticipationPoint point{buffer, overload, ratio, law_steps(buffer, ratio), {}, {}};
      asked.run.steps = steps_of_run(options, scenario.scene.dt_s, point.law);
      if (options.modelled && is_root(scenario))
        point.modelled = run_once(on_virtual_clock(asked, options), options, overload);
      if (options.measured) {
        std::vector<AnticipationRun> measured;
        measured.reserve(static_cast<std::size_t>(options.repeat));
        for (int i = 0; i < options.repeat; ++i)
          measured.push_back(run_once(asked, options, overload));
        point.measured = median_of(std::move(measured));
      }
      points.push_back(point);
    }
  return points;
}

std::vector<BufferCost> makespan_over_buffers(
    const scenarios::Scenario& scenario, const std::vector<std::int64_t>& buffers,
    const std::function<void(std::size_t, std::size_t)>& progress) {
  std::vector<BufferCost> costs;
  for (const std::int64_t buffer : buffers) {
    progress(costs.size(), buffers.size());
    models::RunOptions run = scenario.run;
    run.buffer = buffer;
    const MeasuredRun measured =
        measure_run(scenario.scene, scenario.initial, scenario.territory, run, {}, {});
    costs.push_back({.buffer = buffer,
                     .makespan_s = 1e-9 * static_cast<double>(measured.result.cluster->makespan_ns),
                     .efficiency = efficiency(measured.result.events),
                     .lead_steps = mean_lead_steps(measured.result.events),
                     .buffer_bytes = bytes_of_buffers(measured.result.worlds, buffer,
                                                      scenario.territory.worlds)});
  }
  return costs;
}

std::int64_t knee_of(const std::vector<BufferCost>& costs, double tolerance) {
  const double best =
      std::ranges::min_element(costs, {}, &BufferCost::makespan_s)->makespan_s * (1.0 + tolerance);
  std::int64_t knee = costs.front().buffer;
  bool any = false;
  for (const BufferCost& cost : costs)
    if (cost.makespan_s <= best && (!any || cost.buffer < knee)) {
      knee = cost.buffer;
      any = true;
    }
  return knee;
}

}  // namespace soda::analysis
