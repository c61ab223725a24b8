#include "physics/step/step.hpp"

#include <utility>

#include "physics/integrators/free_flight.hpp"
#include "physics/step/advance_island.hpp"

namespace soda::physics {
void compute_boxes(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids, std::span<const BodyState> states,
                   std::vector<Aabb>& boxes, StageCounters& counters) {
  boxes.resize(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    boxes[i] = swept_aabb(scene, geometry, ids[i], states[i]);
  }
  counters.boxes += ids.size();
}

void find_contacts(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids, std::span<const BodyState> states,
                   StepScratch& scratch, StageCounters& counters) {
  scratch.resting.start(ids, states);
  scratch.kept.find({scene, geometry, ids, states, scratch.boxes}, scratch.pairs, counters);
  find_static_pairs(geometry, scratch.boxes, scratch.static_pairs, counters);
  scratch.manifolds.clear();
  // Statics have the higher ids: per first body, its dynamic partners come before them.
  std::size_t p = 0, s = 0;
  while (p < scratch.pairs.size() || s < scratch.static_pairs.size()) {
    const bool dynamic =
        s == scratch.static_pairs.size() ||
        (p < scratch.pairs.size() && scratch.pairs[p].first <= scratch.static_pairs[s].first);
    const IndexPair pair = dynamic ? scratch.pairs[p++] : scratch.static_pairs[s++];
    const BodyId a = ids[pair.first], b = dynamic ? ids[pair.second] : static_id(pair.second);
    if (scratch.resting.take_contacts(a, b, scratch.manifolds)) {
      ++counters.pairs_at_rest;
      continue;
    }
    collide({scene, geometry, scene.dt_s, a, states[pair.first], b,
             dynamic ? &states[pair.second] : nullptr},
            scratch.manifolds, counters);
  }
  append_world_joints(scene, ids, states, scratch.manifolds);
}

// Statics are compared with all boxes. Without them, only those are made that KeptPairs asks for.
void find_contacts_alone(const SceneDescription& scene, const Geometry& geometry,
                         std::span<const BodyId> ids, std::span<const BodyState> states,
                         StepScratch& scratch, StageCounters& counters) {
  if (!scene.statics.empty()) {
    compute_boxes(scene, geometry, ids, states, scratch.boxes, counters);
  } else {
    scratch.boxes.clear();
    counters.boxes += ids.size();
  }
  find_contacts(scene, geometry, ids, states, scratch, counters);
}

// States move into the scratch and back: their impulse lists change hands, nothing is allocated.
void gather_island(std::size_t island, std::span<const BodyId> ids, std::span<BodyState> states,
                   StepScratch& scratch) {
  const Islands& islands = scratch.islands;
  scratch.island_ids.clear();
  scratch.island_manifolds.clear();
  scratch.island_states.resize(islands.body_begin[island + 1] - islands.body_begin[island]);
  for (std::uint32_t i = islands.body_begin[island]; i < islands.body_begin[island + 1]; ++i) {
    const std::uint32_t body = islands.bodies[i];
    scratch.island_ids.push_back(ids[body]);
    std::swap(scratch.island_states[i - islands.body_begin[island]], states[body]);
  }
  for (std::uint32_t i = islands.manifold_begin[island]; i < islands.manifold_begin[island + 1];
       ++i) {
    scratch.island_manifolds.push_back(scratch.manifolds[islands.manifolds[i]]);
  }
}

void scatter_island(std::size_t island, std::span<BodyState> states, StepScratch& scratch) {
  const Islands& islands = scratch.islands;
  for (std::uint32_t i = islands.body_begin[island]; i < islands.body_begin[island + 1]; ++i) {
    std::swap(scratch.island_states[i - islands.body_begin[island]], states[islands.bodies[i]]);
  }
}

namespace {

bool take_resting(std::size_t island, std::span<const BodyId> ids, StepScratch& scratch,
                  StepReport& report, StageCounters& counters) {
  scratch.island_ids.clear();
  for (std::uint32_t i = scratch.islands.body_begin[island];
       i < scratch.islands.body_begin[island + 1]; ++i)
    scratch.island_ids.push_back(ids[scratch.islands.bodies[i]]);
  const IslandReport* const known = scratch.resting.take_island(scratch.island_ids);
  if (known == nullptr) return false;
  report.islands.push_back(*known);
  ++counters.islands_at_rest;
  return true;
}

}  // namespace

void advance_bodies(const SceneDescription& scene, const Geometry& geometry,
                    std::span<const BodyId> ids, std::span<BodyState> states,
                    const StepEffects& effects) {
  const auto& [scratch, report, counters] = effects;
  const IslandEffects of_island{scratch.solve, counters, report.faults};
  build_islands(ids, scratch.manifolds, scratch.islands);
  for (std::size_t island = 0; island < scratch.islands.count(); ++island) {
    if (scratch.resting.knows_any() && take_resting(island, ids, scratch, report, counters))
      continue;
    gather_island(island, ids, states, scratch);
    report.islands.push_back(
        advance_island(whole_step(scene, geometry, scratch.island_ids, scratch.island_manifolds),
                       scratch.island_states, of_island));
    if (report.islands.back().rests)
      scratch.resting.keep(scratch.island_ids, scratch.island_manifolds, scratch.island_states,
                           report.islands.back());
    scatter_island(island, states, scratch);
  }
  scratch.resting.finish();
  advance_free_bodies(whole_step(scene, geometry, ids, {}), scratch.islands.free_bodies, states,
                      counters, report.faults);
}

void step(const SceneDescription& scene, const Geometry& geometry, std::span<const BodyId> ids,
          std::span<BodyState> states, const StepEffects& effects) {
  effects.report.islands.clear();
  effects.report.faults.clear();
  find_contacts_alone(scene, geometry, ids, states, effects.scratch, effects.counters);
  advance_bodies(scene, geometry, ids, states, effects);
}

}  // namespace soda::physics
