#include "analysis/scaling/scaling_run.hpp"

#include <algorithm>

#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/undivided_run.hpp"
#include "analysis/scaling/side_by_side.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

constexpr std::int64_t kUsualSteps = 20;
constexpr std::uint32_t kUsualWorlds = 8;  // of a scenario that says one

models::SimulationResult simulate_divided(const scenarios::Scenario& scenario) {
  const models::TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scenario.scene);
  models::SimulationResult result =
      models::simulate(scenario.scene, scenario.initial, map, scenario.run);
  if (result.fault)
    throw NumericalFailure(scenario.name + ", step " + std::to_string(result.fault->step) + ": " +
                           result.fault->what);
  return result;
}

void make_rival(Rival rival, models::RunOptions& options) {
  if (rival == Rival::kLockstep) options.synchronisation = kernel::Synchronisation::kLockstep;
  if (rival == Rival::kInvalidate) options.rollback = models::RollbackMode::kInvalidate;
  if (rival == Rival::kUngated) options.gating = false;
}

ScalingPoint measure_worlds(const scenarios::Scenario& scenario, const UndividedRun& undivided,
                            const std::vector<Rival>& rivals) {
  ScalingPoint point;
  point.worlds = scenario.territory.worlds;
  point.bodies = scenario.initial.size();
  point.one_processor_ns = undivided.cost_ns;
  const models::SimulationResult result = simulate_divided(scenario);
  point.cluster = *result.cluster;
  point.equal = models::final_digest(result) == undivided.digest;
  for (const Rival rival : rivals) {
    scenarios::Scenario changed = scenario;
    make_rival(rival, changed.run);
    const models::SimulationResult other = simulate_divided(changed);
    point.rivals_ns.emplace_back(rival, other.cluster->makespan_ns);
    point.equal = point.equal && models::final_digest(other) == undivided.digest;
  }
  return point;
}

// With one processor for each world.
void divide(const Overrides& overrides, std::uint32_t worlds, scenarios::Scenario& scenario) {
  scenario.territory.worlds = worlds;
  scenario.run.executor = models::ExecutorKind::kVirtual;
  apply_cluster(overrides.cluster, worlds, scenario.run.cluster);
  scenario.run.cluster.processors = std::min(scenario.run.cluster.processors, worlds);
}

std::vector<std::uint32_t> chosen_worlds(const scenarios::Scenario& scenario) {
  const auto cells = static_cast<std::uint32_t>(scenario.territory.grid.cell_count());
  const std::uint32_t own = scenario.territory.worlds;
  return {std::min(own > 1 ? own : kUsualWorlds, cells)};
}

UndividedRun undivided_run(const scenarios::Scenario& scenario) {
  const models::RunOptions& run = scenario.run;
  return run_undivided(scenario.scene, scenario.initial, run, run.steps, run.inputs.script);
}

void measure_strong(const scenarios::Scenario& scenario, const ScalingSetting& setting,
                    ScalingCurve& curve) {
  const auto cells = scenario.territory.grid.cell_count();
  const UndividedRun undivided = undivided_run(scenario);
  for (const std::uint32_t worlds :
       setting.worlds.empty() ? chosen_worlds(scenario) : setting.worlds) {
    if (worlds > cells) {
      curve.left_out += (curve.left_out.empty() ? "" : ", ") + std::to_string(worlds) +
                        " worlds: the grid has " + std::to_string(cells) + " cells";
      continue;
    }
    scenarios::Scenario divided = scenario;
    divide(setting.overrides, worlds, divided);
    curve.points.push_back(measure_worlds(divided, undivided, setting.rivals));
  }
}

void measure_weak(const scenarios::Scenario& scenario, const ScalingSetting& setting,
                  ScalingCurve& curve) {
  curve.left_out = why_single(scenario);
  if (!curve.left_out.empty()) return;
  for (const std::uint32_t worlds :
       setting.worlds.empty() ? chosen_worlds(scenario) : setting.worlds) {
    scenarios::Scenario copies = side_by_side(scenario, worlds);
    const UndividedRun undivided = undivided_run(copies);
    divide(setting.overrides, worlds, copies);
    curve.points.push_back(measure_worlds(copies, undivided, setting.rivals));
  }
}

}  // namespace

const char* name_of(Rival rival) {
  constexpr const char* kNames[] = {"lockstep", "invalidate", "ungated"};
  return kNames[static_cast<int>(rival)];
}

bool ScalingReport::all_equal() const {
  return std::ranges::all_of(curves, [](const ScalingCurve& curve) {
    return std::ranges::all_of(curve.points, &ScalingPoint::equal);
  });
}

ScalingCurve measure_scaling(const std::string& file, const ScalingSetting& setting) {
  scenarios::Scenario scenario = load_scenario(file, setting.overrides);
  if (!setting.overrides.steps) scenario.run.steps = std::min(scenario.run.steps, kUsualSteps);
  ScalingCurve curve{.scenario = scenario.name,
                     .steps = scenario.run.steps,
                     .weak = setting.weak,
                     .points = {},
                     .left_out = {}};
  if (setting.weak)
    measure_weak(scenario, setting, curve);
  else
    measure_strong(scenario, setting, curve);
  return curve;
}

}  // namespace soda::analysis
