#include "analysis/families/family_run.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "analysis/runs/plain_loop.hpp"
#include "analysis/text/stopwatch.hpp"

namespace soda::analysis {
namespace {

// Searches for impacts are not in the count that limits the plain loop.
std::uint64_t family_work(const physics::StageCounters& counters) {
  return work_of(counters) + 1000 * counters.impact_searches();
}

// Fills the errors and counts; false: given up, for it is beyond the budget.
bool run_once(const FamilyScene& family_scene, double budget_s, FamilyRun& run) {
  const physics::SceneDescription& scene = family_scene.scene;
  const physics::Geometry geometry(scene);
  std::vector<physics::BodyState> states = family_scene.states;
  std::vector<physics::BodyId> ids;
  for (std::uint32_t i = 0; i < states.size(); ++i) ids.push_back(physics::BodyId{i});
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  run.errors.clear();
  run.cpu_s = 0.0;
  for (std::int64_t step = 1; step <= run.steps; ++step) {
    const double before_s = thread_cpu_s();
    physics::step(scene, geometry, ids, states, {scratch, report, counters});
    run.cpu_s += thread_cpu_s() - before_s;
    if (!report.faults.empty()) {
      run.fault = "step " + std::to_string(step) + ": " + report.faults[0].what;
      break;
    }
    const std::vector<double> now =
        family_scene.judge({scene, ids, states, report, step, step == run.steps});
    run.errors.resize(now.size());
    for (std::size_t i = 0; i < now.size(); ++i)
      if (!(now[i] <= run.errors[i])) run.errors[i] = now[i];
    if (run.cpu_s > budget_s) return false;
  }
  const double share = 1.0 / (static_cast<double>(run.bodies) * static_cast<double>(run.steps));
  run.work = share * static_cast<double>(family_work(counters));
  run.impacts = share * static_cast<double>(counters.impacts);
  run.row_sweeps = share * static_cast<double>(counters.row_sweeps);
  run.multiplications = share * static_cast<double>(counters.factor_multiplications);
  return true;
}

bool run_repeatedly(const FamilyScene& scene, const RepeatRule& rule, FamilyRun& run) {
  std::vector<double> took_s;
  do {
    if (!run_once(scene, rule.budget_s, run)) return false;
    took_s.push_back(run.cpu_s);
  } while (static_cast<int>(took_s.size()) < rule.repeats && run.cpu_s < rule.long_enough_s);
  std::sort(took_s.begin(), took_s.end());
  run.cpu_s = took_s[took_s.size() / 2];
  if (rule.repeats > 0)
    run.cpu_us =
        1e6 * run.cpu_s / (static_cast<double>(run.bodies) * static_cast<double>(run.steps));
  return true;
}

FamilySeriesReport run_series(const FamilySeries& series, const Family& family,
                              const FamilyRequest& request) {
  FamilySeriesReport report;
  report.name = series.name;
  std::vector<int> sizes = family.sizes;
  if (request.full) sizes.insert(sizes.end(), family.full_sizes.begin(), family.full_sizes.end());
  for (const int n : sizes) {
    const FamilyScene scene = series.build(n);
    FamilyRun run;
    run.n = n;
    run.bodies = scene.states.size();
    run.steps = scene.steps;
    const double growth =
        report.runs.empty() ? 0.0 : double(run.bodies) / double(report.runs.back().bodies);
    const double budget_s = request.timing.budget_s;
    const bool too_long = !report.runs.empty() && report.runs.back().cpu_s * growth > budget_s;
    if (too_long || !run_repeatedly(scene, request.timing, run)) {
      report.left_out = "n from " + std::to_string(n) + " on: beyond the time budget";
      break;
    }
    report.runs.push_back(std::move(run));
  }
  report.misses = family_misses(family.measures, report.runs);
  return report;
}

bool is_jump(double from, double to, double floor) {
  const double a = std::max(from, floor), b = std::max(to, floor);
  return std::isfinite(a) && std::isfinite(b) && std::max(a, b) > kFamilyJump * std::min(a, b);
}

void append_cost_jumps(const FamilyRun& before, const FamilyRun& run,
                       std::vector<FamilyMiss>& misses) {
  if (is_jump(before.work, run.work, kLeastFamilyWork))
    misses.push_back(
        {FamilyFinding::kWorkJump, "work", before.n, run.n, before.work, run.work, ""});
  if (is_jump(before.cpu_us, run.cpu_us, kLeastFamilyTime_us))
    misses.push_back(
        {FamilyFinding::kTimeJump, "CPU time", before.n, run.n, before.cpu_us, run.cpu_us, ""});
}

}  // namespace

const char* name_of(FamilyFinding kind) {
  switch (kind) {
    case FamilyFinding::kFault:
      return "fault";
    case FamilyFinding::kBeyondBound:
      return "beyond the bound";
    case FamilyFinding::kErrorJump:
      return "error jumps";
    case FamilyFinding::kWorkJump:
      return "work jumps";
    case FamilyFinding::kTimeJump:
      return "CPU time jumps";
  }
  return "";
}

std::size_t FamiliesReport::misses() const {
  std::size_t count = 0;
  for (const FamilyReport& family : families)
    for (const FamilySeriesReport& one : family.series)
      count +=
          static_cast<std::size_t>(std::ranges::count_if(one.misses, [](const FamilyMiss& miss) {
            return miss.kind != FamilyFinding::kTimeJump;
          }));
  return count;
}

std::vector<FamilyMiss> family_misses(const std::vector<FamilyMeasure>& measures,
                                      const std::vector<FamilyRun>& runs) {
  std::vector<FamilyMiss> misses;
  const FamilyRun* before = nullptr;
  for (const FamilyRun& run : runs) {
    if (!run.fault.empty()) {
      misses.push_back({FamilyFinding::kFault, "", 0, run.n, 0.0, 0.0, run.fault});
      before = nullptr;
      continue;
    }
    for (std::size_t i = 0; i < measures.size(); ++i) {
      const FamilyMeasure& measure = measures[i];
      if (!(run.errors[i] <= measure.bound))
        misses.push_back({FamilyFinding::kBeyondBound, measure.name, 0, run.n, measure.bound,
                          run.errors[i], ""});
      if (before != nullptr && is_jump(before->errors[i], run.errors[i], measure.floor))
        misses.push_back({FamilyFinding::kErrorJump, measure.name, before->n, run.n,
                          before->errors[i], run.errors[i], ""});
    }
    if (before != nullptr) append_cost_jumps(*before, run, misses);
    before = &run;
  }
  return misses;
}

std::vector<Family> all_families() {
  std::vector<Family> all = ball_row_families();
  for (std::vector<Family>& some : std::vector{contact_families(), joint_families()})
    std::move(some.begin(), some.end(), std::back_inserter(all));
  return all;
}

FamiliesReport measure_families(const std::vector<Family>& families, const FamilyRequest& request,
                                std::ostream& progress) {
  FamiliesReport report;
  report.is_timed = request.timing.repeats > 0;
  for (const Family& family : families) {
    FamilyReport& one = report.families.emplace_back();
    one.name = family.name;
    one.scene = family.scene;
    one.measures = family.measures;
    for (const FamilySeries& series : family.series) {
      progress << "soda accuracy: " << family.name << ", " << series.name << "\n" << std::flush;
      one.series.push_back(run_series(series, family, request));
    }
  }
  return report;
}

}  // namespace soda::analysis
