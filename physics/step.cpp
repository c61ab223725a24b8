#include "physics/step.hpp"

#include <utility>

namespace soda::physics {
namespace {

// States move into the scratch and back (their impulse lists change hands, nothing is allocated).
void advance_one(const SceneDescription& scene, std::size_t island, std::span<const BodyId> ids,
                 std::span<BodyState> states, StepScratch& scratch, StepReport& report,
                 StageCounters& counters) {
  const Islands& islands = scratch.islands;
  const std::span<const std::uint32_t> members(
      islands.bodies.data() + islands.body_begin[island],
      islands.body_begin[island + 1] - islands.body_begin[island]);
  scratch.island_ids.clear();
  scratch.island_manifolds.clear();
  scratch.island_states.resize(members.size());
  for (std::size_t i = 0; i < members.size(); ++i) {
    scratch.island_ids.push_back(ids[members[i]]);
    std::swap(scratch.island_states[i], states[members[i]]);
  }
  for (std::uint32_t m = islands.manifold_begin[island]; m < islands.manifold_begin[island + 1];
       ++m) {
    scratch.island_manifolds.push_back(scratch.manifolds[islands.manifolds[m]]);
  }
  report.islands.push_back(advance_island(scene, scratch.island_ids, scratch.island_manifolds,
                                          scratch.island_states, counters, report.faults));
  for (std::size_t i = 0; i < members.size(); ++i) {
    std::swap(scratch.island_states[i], states[members[i]]);
  }
}

}  // namespace

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
  find_pairs(scene.broadphase, scratch.boxes, scratch.pairs, counters);
  find_static_pairs(geometry, scratch.boxes, scratch.static_pairs, counters);
  scratch.manifolds.clear();
  // Statics have the higher ids: per first body, its dynamic partners come before them.
  std::size_t p = 0, s = 0;
  while (p < scratch.pairs.size() || s < scratch.static_pairs.size()) {
    const bool dynamic =
        s == scratch.static_pairs.size() ||
        (p < scratch.pairs.size() && scratch.pairs[p].first <= scratch.static_pairs[s].first);
    const IndexPair pair = dynamic ? scratch.pairs[p++] : scratch.static_pairs[s++];
    collide(scene, geometry, ids[pair.first], states[pair.first],
            dynamic ? ids[pair.second] : static_id(pair.second),
            dynamic ? &states[pair.second] : nullptr, scratch.manifolds, counters);
  }
}

void advance_bodies(const SceneDescription& scene, std::span<const BodyId> ids,
                    std::span<BodyState> states, StepScratch& scratch, StepReport& report,
                    StageCounters& counters) {
  build_islands(ids, scratch.manifolds, scratch.islands);
  for (std::size_t island = 0; island < scratch.islands.count(); ++island) {
    advance_one(scene, island, ids, states, scratch, report, counters);
  }
  for (const std::uint32_t body : scratch.islands.free_bodies) {
    advance_free_body(scene, ids[body], states[body], counters, report.faults);
  }
}

void step(const SceneDescription& scene, const Geometry& geometry, std::span<const BodyId> ids,
          std::span<BodyState> states, StepScratch& scratch, StepReport& report,
          StageCounters& counters) {
  report.islands.clear();
  report.faults.clear();
  compute_boxes(scene, geometry, ids, states, scratch.boxes, counters);
  find_contacts(scene, geometry, ids, states, scratch, counters);
  advance_bodies(scene, ids, states, scratch, report, counters);
}

}  // namespace soda::physics
