#include "analysis/runs/undivided_run.hpp"

#include "models/cost/work_cost.hpp"

namespace soda::analysis {

UndividedRun run_undivided(const physics::SceneDescription& scene,
                           const std::vector<physics::BodyState>& initial,
                           const models::RunOptions& options, std::int64_t steps,
                           const std::vector<models::UserInput>& inputs) {
  models::RunOptions undivided;
  undivided.first_step = options.first_step;
  undivided.steps = steps;
  undivided.inputs.absent = options.inputs.absent;
  undivided.inputs.script = inputs;
  const models::TerritoryMap whole(models::Grid{}, 1, {models::WorldId{0}});
  const models::SimulationResult result = models::simulate(scene, initial, whole, undivided);
  const auto events = static_cast<std::int64_t>(result.events.executed);
  return {options.constant_cost
              ? options.cluster.bag_cost_ns * events
              : models::undivided_cost_ns(result.events.executed, result.stages, options.weights),
          models::final_digest(result)};
}

std::optional<std::int64_t> one_processor_ns(const physics::SceneDescription& scene,
                                             const std::vector<physics::BodyState>& initial,
                                             const models::RunOptions& options,
                                             const models::SimulationResult& run) {
  if (!run.cluster || run.stopped != 0 || run.fault) return std::nullopt;
  std::vector<models::UserInput> inputs;
  for (const models::CommittedInput& committed : run.inputs) inputs.push_back(committed.input);
  return run_undivided(scene, initial, options, run.committed_steps, inputs).cost_ns;
}

std::optional<double> speed_up(std::optional<std::int64_t> one_processor_ns,
                               const kernel::VirtualReport& cluster) {
  if (!one_processor_ns || cluster.makespan_ns == 0) return std::nullopt;
  return static_cast<double>(*one_processor_ns) / static_cast<double>(cluster.makespan_ns);
}

}  // namespace soda::analysis
