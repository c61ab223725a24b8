#include "soda/run.hpp"

#include <algorithm>
#include <string>

#include "library/src/scene_impl.hpp"
#include "models/run/simulation.hpp"
#include "models/territory/territory.hpp"

namespace soda {
namespace {

std::vector<std::uint32_t> labels_of(const physics::SceneDescription& scene,
                                     std::span<const physics::BodyId> ids) {
  std::vector<std::uint32_t> labels;
  labels.reserve(ids.size());
  for (const physics::BodyId id : ids) labels.push_back(scene.bodies[physics::index_of(id)].label);
  return labels;
}

void require(bool holds, const char* option, const char* allowed) {
  if (!holds) throw UsageError(std::string(option) + ": allowed: " + allowed);
}

models::RunOptions inner(const scenarios::Scenario& scenario, const RunOptions& options) {
  models::RunOptions run = scenario.run;
  run.steps = options.steps.value_or(run.steps);
  run.buffer = options.buffer_entries.value_or(run.buffer);
  require(run.steps >= 0, "steps", "at least 0");
  require(run.buffer >= 1, "buffer_entries", "at least 1");
  if (options.threads) {
    require(*options.threads >= 1, "threads", "at least 1");
    run.executor = models::ExecutorKind::kThreads;
    run.threads = *options.threads;
  }
  for (const Input& input : options.inputs)
    run.inputs.script.push_back(read_input(scenario, input_line(scenario, input)));
  return run;
}

models::TerritoryMap map_of(const scenarios::Scenario& scenario, const RunOptions& options) {
  models::TerritoryOptions territory = scenario.territory;
  territory.worlds = options.worlds.value_or(territory.worlds);
  require(territory.worlds >= 1 && territory.worlds <= territory.grid.cell_count(), "worlds",
          "1 to the number of the territory's cells");
  std::vector<physics::Vec3> places;
  for (const physics::BodyState& state : scenario.initial) places.push_back(state.position_m);
  return models::make_territory_map(territory, places, &scenario.scene);
}

// Tells of committed steps as long as the run goes on.
models::CommitObserver observer_of(const physics::SceneDescription& scene,
                                   const CommitCallback& on_commit) {
  models::CommitObserver observer;
  if (!on_commit) return observer;
  observer.wants_states = true;
  observer.on_step = [&scene, &on_commit](const models::CommittedStep& step) {
    const std::vector<std::uint32_t> labels = labels_of(scene, step.ids);
    std::vector<BodyState> states;
    for (const physics::BodyState& state : step.states) states.push_back(outer(state));
    on_commit({step.step, labels, states});
  };
  return observer;
}

}  // namespace

RunResult run(const Scene& scene, const RunOptions& options, const CommitCallback& on_commit) {
  const scenarios::Scenario& scenario = scene.impl()->scenario;
  const models::SimulationResult result =
      models::simulate(scenario.scene, scenario.initial, map_of(scenario, options),
                       inner(scenario, options), observer_of(scenario.scene, on_commit));
  if (result.fault)
    throw NumericalError(result.fault->step, result.fault->body_label, result.fault->what);
  RunResult run;
  run.steps = result.committed_steps;
  run.digest = models::final_digest(result);
  run.body_ids = labels_of(scenario.scene, result.final_ids);
  for (const physics::BodyId id : result.final_ids)
    run.states.push_back(outer(result.final_states[physics::index_of(id)]));
  run.events_executed = result.events.executed;
  run.events_rolled_back = result.events.rolled_back;
  run.events_committed = result.events.committed;
  return run;
}

}  // namespace soda
