#include "physics/refinement/advance_apart.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/joint.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/refinement/step_doubling.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// Of the width. A gap that closes by less stays as it is; what overlaps more is pushed apart.
constexpr double kClosed = 1e-9, kStayed = 1e-8, kOverlap = 0.5 * kSlop;

Vec3 moved(const Vec3& point, const BodyState& before, const BodyState& after) {
  return after.position_m +
         after.orientation * (before.orientation.conjugate() * (point - before.position_m));
}

// By body: a number of its island, or of its own if it is free.
std::vector<std::uint32_t> islands_of_bodies(const Islands& islands, std::size_t bodies) {
  std::vector<std::uint32_t> island_of(bodies);
  std::uint32_t count = 0;
  for (; count < islands.count(); ++count)
    for (const std::uint32_t body : islands.bodies_of(count)) island_of[body] = count;
  for (const std::uint32_t body : islands.free_bodies) island_of[body] = count++;
  return island_of;
}

// What hits can send from one body of an island to another of it. Whether there is any.
bool keep_links(const IslandStep& island, const Islands& islands,
                std::vector<ContactManifold>& kept) {
  if (std::ranges::none_of(island.manifolds, is_link)) return false;
  const std::vector<std::uint32_t> island_of = islands_of_bodies(islands, island.ids.size());
  const std::size_t before = kept.size();
  for (const ContactManifold& m : island.manifolds)
    if (is_link(m) && !is_static(m.b) &&
        island_of[place_of(island.ids, m.a)] == island_of[place_of(island.ids, m.b)])
      kept.push_back(m);
  std::ranges::sort(kept, canonical_before);
  return kept.size() > before;
}

}  // namespace

// Where fields pull both alike, one may be held.
bool holds(const SceneDescription& scene, const Geometry& geometry, double dt_s,
           const ContactManifold& m, const BodyState& a, const BodyState& b) {
  const double width = width_of(scene, geometry, m.a, m.b);
  const double pulls_a = field_of(scene, m.a).dot(m.normal),
               pulls_b = field_of(scene, m.b).dot(m.normal);
  const double pulled_m =
      std::max({std::abs(pulls_a), std::abs(pulls_b), pulls_a - pulls_b}) * dt_s * dt_s;
  for (std::uint32_t i = 0; i < m.count; ++i) {
    const ContactPoint& p = m.points[i];
    const double approach =
        (velocity_at(a, p.position_m) - velocity_at(b, p.position_m)).dot(m.normal);
    const double gap = p.separation_m - dt_s * approach - pulled_m;
    if (p.separation_m < -kOverlap * width || pressed(a, m, p.feature) ||
        !(gap >= std::min(p.separation_m, 0.0) - kClosed * width))
      return true;
  }
  return false;
}

Islands islands_apart(const IslandStep& island, std::span<const BodyState> states,
                      std::vector<ContactManifold>& kept) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  Islands islands;
  if (scene.tolerance > 0.0 || ids.size() < 2 || std::ranges::any_of(manifolds, is_joint))
    return islands;
  for (const ContactManifold& m : manifolds)
    if (is_static(m.b) ||
        holds(scene, geometry, dt_s, m, states[place_of(ids, m.a)], states[place_of(ids, m.b)]))
      kept.push_back(m);
  if (kept.size() == manifolds.size()) return islands;
  build_islands(ids, kept, islands);
  if (keep_links(island, islands, kept)) build_islands(ids, kept, islands);
  return islands;
}

namespace {

// Whether its points have kept their gaps.
bool has_kept_gaps(const ContactManifold& m, double width_m, const IslandMove& move, std::size_t a,
                   std::size_t b) {
  for (std::uint32_t i = 0; i < m.count; ++i) {
    const ContactPoint& p = m.points[i];
    const Vec3 apart = moved(p.position_m, move.start[b], move.end[b]) -
                       moved(p.position_m, move.start[a], move.end[a]);
    const double gap = p.separation_m + apart.dot(m.normal);
    if (!(gap >= std::min(p.separation_m, 0.0) - kStayed * width_m)) return false;
  }
  return true;
}

// Whether what has come round overlaps.
bool has_come_round(const IslandStep& island, const ContactManifold& m, double width_m,
                    const IslandMove& move, StageCounters& counters) {
  const std::size_t a = place_of(island.ids, m.a), b = place_of(island.ids, m.b);
  if (!turns_far(island, move, a) && !turns_far(island, move, b)) return false;
  std::vector<ContactManifold> found;
  collide({island.scene, island.geometry, 0.0, m.a, move.end[a], m.b, &move.end[b]}, found,
          counters);
  ++counters.turned_searches;
  const double least_m = std::min(least_separation_m(m), 0.0) - kStayed * width_m;
  return std::ranges::any_of(
      found, [&](const ContactManifold& now) { return least_separation_m(now) < least_m; });
}

}  // namespace

bool stayed_apart(const IslandStep& island, const Islands& islands, const IslandMove& move,
                  StageCounters& counters) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const std::vector<std::uint32_t> island_of = islands_of_bodies(islands, ids.size());
  for (const ContactManifold& m : manifolds) {
    if (is_static(m.b)) continue;
    const std::size_t a = place_of(ids, m.a), b = place_of(ids, m.b);
    if (island_of[a] == island_of[b]) continue;
    if (is_link(m)) {
      std::vector<ContactManifold> found;
      const double overlap_m = meet_on_path_m(island, move, m, counters, found);
      if (overlap_m > kMostGrowth * size_of(scene, m)) return false;
      continue;
    }
    const double width = width_of(scene, geometry, m.a, m.b);
    if (!has_kept_gaps(m, width, move, a, b) || has_come_round(island, m, width, move, counters))
      return false;
  }
  return true;
}

}  // namespace soda::physics
