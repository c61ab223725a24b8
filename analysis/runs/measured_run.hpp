// One run of a scenario with everything that is reported of it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "analysis/measures/error_estimates.hpp"
#include "analysis/measures/error_measures.hpp"
#include "analysis/text/stopwatch.hpp"
#include "models/run/plan.hpp"
#include "models/run/simulation.hpp"

namespace soda::analysis {

struct MeasuredRun {
  std::int64_t steps = 0;  // that it made
  Cost cost;               // of the simulation, without reading and reporting
  ErrorMeasures error;
  std::optional<ErrorEstimates> estimates;  // in accuracy mode
  std::uint64_t digest = 0;                 // of the state after the last step
  models::SimulationResult result;
  std::vector<models::PlanLine> plan;
  std::vector<std::uint64_t> plan_counters;  // one per plan line
};

// Of bodies, as a territory map is made from them.
std::vector<physics::Vec3> centres(std::span<const physics::BodyState> states);

// Runs the scene divided by `territory` and measures. `observer` gets every committed step.
// Throws NumericalFailure if a fault was committed.
MeasuredRun measure_run(const physics::SceneDescription& scene,
                        const std::vector<physics::BodyState>& initial,
                        const models::TerritoryOptions& territory,
                        const models::RunOptions& options, const models::CommitObserver& observer,
                        const std::function<void(const models::Progress&)>& progress);

// On a rank that is not the root: runs its worlds. What happens is known at the root.
void take_part(const physics::SceneDescription& scene,
               const std::vector<physics::BodyState>& initial,
               const models::TerritoryOptions& territory, const models::RunOptions& options,
               const models::CommitObserver& observer);

// Plan lines that promised no work, yet counted some: a defect, or an untrue plan.
std::vector<std::string> broken_plan_lines(const MeasuredRun& run);

// The per-stage work of a run by name, physics stages first; the order is fixed.
std::vector<std::pair<std::string, std::uint64_t>> stage_counts(
    const models::SimulationResult& result);

// What became of islands: how many were committed, solved, and so on.
std::vector<std::pair<std::string, std::uint64_t>> island_counts(
    const models::SimulationResult& result);

// Labels of the joints that are broken at the end, ascending.
std::vector<std::uint32_t> broken_joints(const models::SimulationResult& result);

// Fractions and means that reports share; 0 where nothing was executed.
double efficiency(const kernel::Counters& events);  // 1 - rolled back / executed
double mean_lead_steps(const kernel::Counters& events);

}  // namespace soda::analysis
