#include "physics/step/step.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "physics/broadphase/box_tree.hpp"
#include "physics/broadphase/occupied_cells.hpp"
#include "physics/integrators/free_flight.hpp"
#include "physics/shapes/geometry_impl.hpp"
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
  scratch.pair_cache.find({scene, geometry, ids, states, scratch.boxes}, scratch.pairs, counters);
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

// Statics are compared with all boxes. Without them, only those are made that PairCache asks for.
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

void forget_reports(std::span<const BodyId> ids, StepReport& report) {
  const auto is_one = [ids](BodyId id) { return std::ranges::binary_search(ids, id); };
  std::erase_if(report.islands, [&](const IslandReport& island) { return is_one(island.label); });
  std::erase_if(report.faults, [&](const AdvanceFault& fault) { return is_one(fault.body); });
}

namespace {

// A step on its way through its passes.
struct Advance {
  const SceneDescription& scene;
  const Geometry& geometry;
  std::span<const BodyId> ids;
  std::span<BodyState> states;
  const StepEffects& effects;
};

bool take_resting(std::size_t island, std::size_t manifolds, const Advance& of) {
  const auto& [scratch, report, counters] = of.effects;
  if (!scratch.resting.knows_any()) return false;
  scratch.island_ids.clear();
  for (const std::uint32_t body : scratch.islands.bodies_of(island))
    scratch.island_ids.push_back(of.ids[body]);
  const IslandReport* const known = scratch.resting.take_island(scratch.island_ids);
  if (known == nullptr) return false;
  report.islands.push_back(*known);
  ++counters.islands_at_rest;
  for (const std::uint32_t body : scratch.islands.bodies_of(island))
    scratch.passes.keep(body, manifolds);
  return true;
}

void advance_one(std::size_t island, std::size_t manifolds, bool again, const Advance& of) {
  const auto& [scene, geometry, ids, states, effects] = of;
  const auto& [scratch, report, counters] = effects;
  gather_island(island, ids, states, scratch);
  const std::span<const std::uint32_t> bodies = scratch.islands.bodies_of(island);
  const BodyId linked = linked_label(scratch.island_ids, scratch.island_manifolds);
  for (std::size_t i = 0; i < bodies.size(); ++i)
    scratch.passes.begin(bodies[i], manifolds, linked, scratch.island_states[i]);
  if (again) forget_reports(scratch.island_ids, report);
  counters.islands_again += again;
  report.islands.push_back(
      advance_island(whole_step(scene, geometry, scratch.island_ids, scratch.island_manifolds),
                     scratch.island_states, {scratch.solve, counters, report.faults}));
  if (report.islands.back().rests && !again)
    scratch.resting.keep(scratch.island_ids, scratch.island_manifolds, scratch.island_states,
                         report.islands.back());
  for (std::size_t i = 0; i < bodies.size() && !report.islands.back().rests; ++i)
    scratch.passes.end(scene, geometry, scratch.island_ids[i], bodies[i], scratch.island_states[i],
                       scratch.boxes.empty() ? nullptr : &scratch.boxes[bodies[i]]);
  scatter_island(island, states, scratch);
}

// Those that have not been advanced yet as they are now.
void advance_islands(bool again, const Advance& of) {
  StepScratch& scratch = of.effects.scratch;
  build_islands(of.ids, scratch.manifolds, scratch.islands);
  for (std::size_t island = 0; island < scratch.islands.count(); ++island) {
    const std::uint32_t first = scratch.islands.bodies[scratch.islands.body_begin[island]];
    const std::size_t manifolds =
        scratch.islands.manifold_begin[island + 1] - scratch.islands.manifold_begin[island];
    if (!scratch.passes.is_new(first, manifolds)) continue;
    if (again || !take_resting(island, manifolds, of)) advance_one(island, manifolds, again, of);
  }
}

// All that it has come to.
Aabb box_of(const Advance& of, std::uint32_t body, const BodyState& start) {
  const StepScratch& scratch = of.effects.scratch;
  if (scratch.passes.was_sent(body)) return scratch.passes.box_of_sent(body);
  return scratch.boxes.empty() ? swept_aabb(of.scene, of.geometry, of.ids[body], start)
                               : scratch.boxes[body];
}

// Whether somebody that was sent on comes to somebody new. Few other boxes are made.
bool connect_sent(const Advance& of) {
  const auto& [scene, geometry, ids, states, effects] = of;
  const auto& [scratch, report, counters] = effects;
  Passes& passes = scratch.passes;
  if (passes.ever_sent().empty()) return false;
  passes.next_pass();
  const std::vector<Passes::Sent>& sent = passes.ever_sent();
  std::vector<Aabb> boxes;
  boxes.reserve(sent.size());
  for (const Passes::Sent& s : sent) boxes.push_back(s.box);
  const OccupiedCells cells(boxes);
  const BoxTree tree(boxes);
  std::vector<std::uint32_t> near;
  bool any = false;
  for (std::uint32_t other = 0; other < ids.size(); ++other) {
    const bool was_sent = passes.was_sent(other);
    if (!was_sent && scratch.boxes.empty() && !cells.may_overlap(scratch.pair_cache.fat_box(other)))
      continue;
    const BodyState& start = passes.start_of(other, states[other]);
    const Aabb box = box_of(of, other, start);
    tree.find(box, near);
    if (near.empty()) continue;
    const BodyState end = passes.end_of(scene, ids[other], other, states[other]);
    const MovingBody mine{ids[other], start, end, box, passes.linked_label_of(other)};
    for (const std::uint32_t i : near) {
      const std::uint32_t place = sent[i].place;
      if (place == other || (was_sent && place < other)) continue;
      const MovingBody theirs{ids[place], passes.start_of(place, states[place]), states[place],
                              sent[i].box, passes.linked_label_of(place)};
      const auto& [a, b] = place < other ? std::tie(theirs, mine) : std::tie(mine, theirs);
      if (may_meet(scene, geometry, a, b, counters))
        any = connect(scene, a.id, a.start, b.id, scratch.manifolds) || any;
    }
  }
  return any;
}

}  // namespace

void advance_bodies(const SceneDescription& scene, const Geometry& geometry,
                    std::span<const BodyId> ids, std::span<BodyState> states,
                    const StepEffects& effects) {
  const auto& [scratch, report, counters] = effects;
  const Advance all{scene, geometry, ids, states, effects};
  scratch.passes.start(ids.size());
  advance_islands(false, all);
  while (connect_sent(all)) advance_islands(true, all);
  std::ranges::sort(report.islands, {}, &IslandReport::label);
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
