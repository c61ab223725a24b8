#include "physics/events/linked_step.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/joint_rows.hpp"
#include "physics/continuous/time_of_impact.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/refinement/advance_resting.hpp"
#include "physics/refinement/refined_trials.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

struct LinkedIsland {
  const SceneDescription& scene;
  const Geometry& geometry;
  std::span<const BodyId> ids;
  SolveScratch& scratch;
  StageCounters& counters;

  const CompiledShape& shape_of(std::size_t body) const {
    return geometry.impl().shapes[scene.bodies[index_of(ids[body])].shape].shape;
  }
  std::size_t place_of(BodyId id) const {
    return static_cast<std::size_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  }
};

// The vector of the rotation that leads from one orientation to another, up to half a turn. To a
// hundredth: it says where to look, not where things are.
Vec3 turn_between(const Quat& from, const Quat& to) {
  const Quat turn = to * from.conjugate();
  const double sign = turn.w() < 0.0 ? -1.0 : 1.0;
  const double quarter = turn.vec().norm() / (1.0 + sign * turn.w());  // its tangent
  if (!(quarter > 0.0)) return Vec3::Zero();
  const double squared = quarter * quarter;
  const double angle = 4.0 * quarter * (15.0 + 4.0 * squared) / (15.0 + 9.0 * squared);
  return turn.vec() * (sign * angle / turn.vec().norm());
}

// Free flight from where a part began to where it ended.
BodyState way_between(const SceneDescription& scene, double time_s, const BodyState& before,
                      const BodyState& after) {
  BodyState start;
  start.position_m = before.position_m;
  start.orientation = before.orientation;
  start.linear_velocity_m_s =
      (after.position_m - before.position_m) / time_s - scene.gravity_m_s2 * (0.5 * time_s);
  start.angular_velocity_rad_s = turn_between(before.orientation, after.orientation) / time_s;
  return start;
}

// Contacts that are nearer than the margin are kept anyway.
bool is_unforeseen(const LinkedIsland& island, double time_s, std::size_t body,
                   const BodyState& before, const BodyState& way) {
  const CompiledShape& shape = island.shape_of(body);
  const double off_m =
      time_s * ((way.linear_velocity_m_s - before.linear_velocity_m_s).norm() +
                (shape.kind == ShapeKind::kSphere
                     ? 0.0
                     : shape.bounding_radius_m *
                           (way.angular_velocity_rad_s - before.angular_velocity_rad_s).norm()));
  return off_m > kContactMargin * shape.min_extent_m;
}

struct Touching {
  BodyId a{}, b{};
};

// `manifolds` in canonical order.
bool is_among(std::span<const ContactManifold> manifolds, const Touching& pair) {
  ContactManifold first;
  first.a = pair.a;
  first.b = pair.b;
  const auto at = std::ranges::lower_bound(manifolds, first, canonical_before);
  return at != manifolds.end() && at->a == pair.a && at->b == pair.b && !is_joint(*at);
}

// All pairs that can touch on these ways.
std::vector<Touching> pairs_in_reach(const LinkedIsland& island, std::span<const BodyState> ways) {
  std::vector<Aabb> boxes;
  for (std::size_t i = 0; i < ways.size(); ++i)
    boxes.push_back(swept_aabb(island.scene, island.geometry, island.ids[i], ways[i]));
  std::vector<IndexPair> found;
  std::vector<Touching> pairs;
  find_pairs(island.scene.broadphase, boxes, found, island.counters);
  for (const IndexPair& p : found)
    if (may_touch(island.scene, island.ids[p.first], island.ids[p.second]))
      pairs.push_back({island.ids[p.first], island.ids[p.second]});
  find_static_pairs(island.geometry, boxes, found, island.counters);
  for (const IndexPair& p : found)
    if (may_touch(island.scene, island.ids[p.first], static_id(p.second)))
      pairs.push_back({island.ids[p.first], static_id(p.second)});
  return pairs;
}

// Appends the contacts of pairs without manifold that touch on these ways, as they are seen at the
// step's start by who knows the ways. Whether there are any.
bool append_unseen(const LinkedIsland& island, double time_s, std::span<const BodyState> before,
                   std::span<const BodyState> ways, std::vector<ContactManifold>& manifolds) {
  std::vector<bool> unforeseen;
  for (std::size_t i = 0; i < ways.size(); ++i)
    unforeseen.push_back(is_unforeseen(island, time_s, i, before[i], ways[i]));
  if (std::ranges::find(unforeseen, true) == unforeseen.end()) return false;
  std::vector<ContactManifold> found;
  for (const Touching& pair : pairs_in_reach(island, ways)) {
    const std::size_t a = island.place_of(pair.a);
    const std::size_t b = is_static(pair.b) ? a : island.place_of(pair.b);
    const BodyState* const way_b = is_static(pair.b) ? nullptr : &ways[b];
    if ((!unforeseen[a] && !unforeseen[b]) || is_among(manifolds, pair)) continue;
    if (!is_mesh(island.scene, pair.b)) {
      ++island.counters.linked_searches;
      if (!time_of_impact(island.scene, island.geometry, pair.a, ways[a], pair.b, way_b, time_s))
        continue;
    }
    collide(island.scene, island.geometry, time_s, pair.a, ways[a], pair.b, way_b, found,
            island.counters);
  }
  std::erase_if(found, is_joint);
  if (found.empty()) return false;
  manifolds.insert(manifolds.end(), found.begin(), found.end());
  std::ranges::sort(manifolds, canonical_before);
  return true;
}

// Where the bodies are now: along their own velocities, and where that finds none along the ways
// that the joints drew them.
std::vector<ContactManifold> contacts_now(const LinkedIsland& island, double time_s,
                                          std::span<const ContactManifold> before,
                                          std::span<const BodyState> states,
                                          std::span<const BodyState> ways) {
  std::vector<BodyState> drawn(states.begin(), states.end());
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    drawn[i].linear_velocity_m_s = ways[i].linear_velocity_m_s;
    drawn[i].angular_velocity_rad_s = ways[i].angular_velocity_rad_s;
  }
  std::vector<ContactManifold> found;
  const auto look = [&](const Touching& pair, std::span<const BodyState> at) {
    const BodyState* const b = is_static(pair.b) ? nullptr : &at[island.place_of(pair.b)];
    collide(island.scene, island.geometry, time_s, pair.a, at[island.place_of(pair.a)], pair.b, b,
            found, island.counters);
    std::erase_if(found, is_joint);
  };
  std::vector<Touching> pairs = pairs_in_reach(island, states);
  for (const Touching& pair : pairs_in_reach(island, drawn)) pairs.push_back(pair);
  std::sort(pairs.begin(), pairs.end(), [](const Touching& x, const Touching& y) {
    return x.a < y.a || (x.a == y.a && x.b < y.b);
  });
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i > 0 && pairs[i].a == pairs[i - 1].a && pairs[i].b == pairs[i - 1].b) continue;
    const std::size_t count = found.size();
    look(pairs[i], states);
    if (found.size() == count) look(pairs[i], drawn);
  }
  for (const ContactManifold& m : before)
    if (is_joint(m)) found.push_back(m);
  std::sort(found.begin(), found.end(), canonical_before);
  return found;
}

// By how much a pair came to overlap, of the smaller body's width; overlaps there were do not
// count. Pairs of which nothing moved by the margin are left out, and those of bodies that have no
// manifold: these are looked for on the way.
double sunk_widths(const LinkedIsland& island, std::span<const ContactManifold> manifolds,
                   std::span<const BodyState> before, std::span<const BodyState> after,
                   std::span<const BodyState> ways, double time_s) {
  std::vector<bool> moved;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const CompiledShape& shape = island.shape_of(i);
    const double way_m = (after[i].position_m - before[i].position_m).norm() +
                         shape.bounding_radius_m * time_s * ways[i].angular_velocity_rad_s.norm();
    moved.push_back(way_m > kContactMargin * shape.min_extent_m);
  }
  double most = 0.0;
  for (const Touching& pair : pairs_in_reach(island, after)) {
    const std::size_t a = island.place_of(pair.a);
    const bool fixed = is_static(pair.b);
    const std::size_t b = fixed ? a : island.place_of(pair.b);
    if ((!moved[a] && !moved[b]) || is_mesh(island.scene, pair.b)) continue;
    if (!fixed && !is_among(manifolds, pair)) continue;
    const auto depth_m = [&](std::span<const BodyState> at) {
      const Separation apart = separation_of(island.scene, island.geometry, pair.a, at[a], pair.b,
                                             fixed ? nullptr : &at[b]);
      return std::max(0.0, -apart.distance_m);
    };
    const double width = std::min(island.shape_of(a).min_extent_m, island.shape_of(b).min_extent_m);
    const double depth = depth_m(after);
    if (depth > most * width) most = std::max(most, (depth - depth_m(before)) / width);
  }
  return most;
}

struct LinkedPart {
  IslandReport report;
  std::vector<AdvanceFault> faults;
  std::vector<BodyState> ways;  // that the bodies came
};

// A part of the step, with what the joints draw bodies to: its contacts are appended to the
// manifolds.
LinkedPart advance_part(const LinkedIsland& island, double time_s,
                        std::span<const BodyState> before, std::vector<ContactManifold>& manifolds,
                        std::span<BodyState> states) {
  constexpr int kMostLooks = 3;
  for (int look = 0;; ++look) {
    LinkedPart part;
    std::ranges::copy(before, states.begin());
    part.report = advance_resting(island.scene, island.geometry, time_s, island.ids, manifolds,
                                  states, island.scratch, island.counters, part.faults);
    for (std::size_t i = 0; i < states.size(); ++i)
      part.ways.push_back(way_between(island.scene, time_s, before[i], states[i]));
    if (look == kMostLooks || !append_unseen(island, time_s, before, part.ways, manifolds))
      return part;
  }
}

// Impulses of a part are the start of one of another length. Those of a hit in a shorter part are
// not what a longer one has.
void share_impulses(const LinkedIsland& island, double time_s, double next_s,
                    std::span<const BodyState> before, std::span<BodyState> states) {
  constexpr double kOfLoads = 4.0;
  const double most_m_s = kOfLoads * island.scene.gravity_m_s2.norm() * time_s;
  bool hit = false;
  for (std::size_t i = 0; i < states.size(); ++i)
    hit = hit || (states[i].linear_velocity_m_s - before[i].linear_velocity_m_s).squaredNorm() >
                     most_m_s * most_m_s;
  if (next_s < time_s || !hit) scale_impulses(next_s / time_s, states);
}

}  // namespace

Need linked_impacts_needed(const SceneDescription& scene) {
  const Need joints = joint_rows_needed(scene), contacts = contacts_needed(scene);
  if (!joints) return joints;
  if (!contacts) return contacts;
  return need_of(scene.bodies.size() > 1 || solid_statics(scene) > 0,
                 "joints can draw bodies into others",
                 "one body hangs on joints, and there is nothing solid to be drawn into");
}

bool is_linked(std::span<const ContactManifold> manifolds) {
  return std::any_of(manifolds.begin(), manifolds.end(), is_joint);
}

IslandReport advance_linked(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                            std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                            std::span<BodyState> states, SolveScratch& scratch,
                            StageCounters& counters, std::vector<AdvanceFault>& faults) {
  constexpr double kVisible = 0.003;  // what sinks by less, of a width, is not worth a part
  constexpr int kMostHalvings = 3, kMostParts = 8;
  if (ids.size() == 1 && scene.statics.empty())  // there is nothing to come to
    return advance_resting(scene, geometry, dt_s, ids, manifolds, states, scratch, counters,
                           faults);
  const LinkedIsland island{scene, geometry, ids, scratch, counters};
  std::vector<ContactManifold> met(manifolds.begin(), manifolds.end());
  IslandReport report;
  double left_s = dt_s;
  for (int number = 0; left_s > 0.0; ++number) {
    const std::vector<BodyState> before(states.begin(), states.end());
    double time_s = left_s;
    LinkedPart part = advance_part(island, time_s, before, met, states);
    for (int halvings = 0; halvings < kMostHalvings && number + 1 < kMostParts; ++halvings) {
      if (!(sunk_widths(island, met, before, states, part.ways, time_s) > kVisible)) break;
      time_s *= 0.5;
      part = advance_part(island, time_s, before, met, states);
    }
    faults.insert(faults.end(), part.faults.begin(), part.faults.end());
    if (number == 0)
      report = part.report;
    else
      add_part(part.report, report);
    left_s -= time_s;
    share_impulses(island, time_s, left_s > 0.0 ? left_s : dt_s, before, states);
    if (!(left_s > 0.0)) break;
    met = contacts_now(island, left_s, met, states, part.ways);
  }
  return report;
}

}  // namespace soda::physics
