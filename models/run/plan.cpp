#include "models/run/plan.hpp"

#include <algorithm>
#include <utility>

#include "models/islands/split_plan.hpp"
#include "models/options/run_stages.hpp"
#include "physics/step/stages.hpp"

namespace soda::models {
namespace {

using physics::Need;
using physics::SceneDescription;

void add(std::string stage, const Need& need,
         std::function<std::uint64_t(const SimulationResult&)> count, std::vector<PlanLine>& plan) {
  plan.push_back({std::move(stage), need.is_needed, need.reason, std::move(count)});
}

void add(const char* stage, const Need& need, std::uint64_t WorldCounters::*member,
         std::vector<PlanLine>& plan) {
  add(
      stage, need, [member](const SimulationResult& result) { return result.worlds.*member; },
      plan);
}

bool may_change_materials(const InputOptions& inputs) {
  return inputs.live != nullptr || std::ranges::any_of(inputs.script, [](const UserInput& input) {
           return input.kind == InputKind::kChangeMaterial;
         });
}

// Of each body the roughest and springiest surface that user input may give it.
SceneDescription with_possible_materials(SceneDescription scene, const InputOptions& inputs) {
  const auto allow = [&scene](std::size_t body, const physics::Material& material) {
    physics::Material& most = scene.bodies[body].material;
    most.friction = std::max(most.friction, material.friction);
    most.restitution = std::max(most.restitution, material.restitution);
    most.rolling_friction_m = std::max(most.rolling_friction_m, material.rolling_friction_m);
    most.torsional_friction_m = std::max(most.torsional_friction_m, material.torsional_friction_m);
  };
  for (const UserInput& input : inputs.script)
    if (input.kind == InputKind::kChangeMaterial)
      allow(physics::index_of(input.body), input.material);
  if (inputs.live != nullptr)
    for (std::size_t body = 0; body < scene.bodies.size(); ++body)
      allow(body, {1.0, 1.0, 1.0, 1.0});
  return scene;
}

void add_exchange(const SceneDescription& scene, std::uint32_t worlds,
                  std::vector<PlanLine>& plan) {
  const Need borders = borders_needed(worlds), shared = shared_contacts_needed(scene, worlds);
  add("border tests", borders, &WorldCounters::border_tests, plan);
  add("ghost messages", borders, &WorldCounters::ghosts_sent, plan);
  add("fragment messages", shared, &WorldCounters::fragments_sent, plan);
  add("island merging", shared, &WorldCounters::records_sent, plan);
  add("migration messages", borders, &WorldCounters::migrations, plan);
}

void add_run(const SceneDescription& scene, std::uint32_t worlds, const RunOptions& options,
             std::vector<PlanLine>& plan) {
  add("buffer entries for rollback", entries_needed(options, worlds), &WorldCounters::entries_saved,
      plan);
  add("islands taken over by repeated steps", repetition_needed(options, worlds),
      &WorldCounters::islands_taken, plan);
  add("giant islands split between worlds", splits_needed(scene, options, worlds),
      &WorldCounters::islands_split, plan);
  add(
      "load balancing", balancing_needed(options, worlds),
      [](const SimulationResult& result) {
        return result.worlds.bodies_sampled + result.territory_changes.size();
      },
      plan);
  add(
      "rollback", rollback_needed(options, worlds),
      [](const SimulationResult& result) { return result.events.rollbacks; }, plan);
  add("user input messages",
      physics::need_of(options.inputs.any(), "a user acts on bodies", "nobody acts from outside"),
      &WorldCounters::inputs, plan);
}

}  // namespace

std::vector<PlanLine> make_plan(const SceneDescription& scene, std::uint32_t worlds,
                                const RunOptions& options) {
  std::vector<PlanLine> plan;
  for (const physics::Stage& stage :
       may_change_materials(options.inputs)
           ? physics::stages_of(with_possible_materials(scene, options.inputs))
           : physics::stages_of(scene))
    add(
        stage.name, stage.need,
        [count = stage.count](const SimulationResult& result) { return count(result.stages); },
        plan);
  add_exchange(scene, worlds, plan);
  add_run(scene, worlds, options, plan);
  return plan;
}

std::vector<std::uint64_t> plan_counters(const std::vector<PlanLine>& plan,
                                         const SimulationResult& result) {
  std::vector<std::uint64_t> counts;
  counts.reserve(plan.size());
  for (const PlanLine& line : plan) counts.push_back(line.count(result));
  return counts;
}

}  // namespace soda::models
