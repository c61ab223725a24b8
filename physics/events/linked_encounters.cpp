#include "physics/events/linked_encounters.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

// Contacts that are nearer than the margin are kept anyway.
bool may_miss_pairs(const LinkedIsland& island, double time_s, std::size_t body,
                    const BodyState& before, const BodyState& motion) {
  const CompiledShape& shape = island.shape_of(body);
  const double off_m =
      time_s * ((motion.linear_velocity_m_s - before.linear_velocity_m_s).norm() +
                (shape.kind == ShapeKind::kSphere
                     ? 0.0
                     : shape.bounding_radius_m *
                           (motion.angular_velocity_rad_s - before.angular_velocity_rad_s).norm()));
  return off_m > (island.wedged ? kTooDeep : kContactMargin) * shape.min_extent_m;
}

// Whether the manifolds, in canonical order, have a contact of the pair.
bool have_touched(std::span<const ContactManifold> manifolds, const Touching& pair) {
  ContactManifold first;
  first.a = pair.a;
  first.b = pair.b;
  for (auto at = std::ranges::lower_bound(manifolds, first, canonical_before);
       at != manifolds.end() && at->a == pair.a && at->b == pair.b && !is_joint(*at); ++at)
    if (at->count > 0) return true;
  return false;
}

// All pairs that can touch in these motions.
std::vector<Touching> query_swept_pairs(const LinkedIsland& island,
                                        std::span<const BodyState> motions) {
  std::vector<Aabb> boxes;
  for (std::size_t i = 0; i < motions.size(); ++i)
    boxes.push_back(swept_aabb(island.scene, island.geometry, island.ids[i], motions[i]));
  std::vector<IndexPair> found;
  std::vector<Touching> pairs;
  find_pairs(island.scene.broadphase, boxes, found, island.counters);
  for (const IndexPair& p : found)
    if (may_touch(island.scene, island.ids[p.first], motions[p.first], island.ids[p.second]))
      pairs.push_back({island.ids[p.first], island.ids[p.second]});
  find_static_pairs(island.geometry, boxes, found, island.counters);
  for (const IndexPair& p : found)
    if (may_touch(island.scene, island.ids[p.first], motions[p.first], static_id(p.second)))
      pairs.push_back({island.ids[p.first], static_id(p.second)});
  return pairs;
}

std::optional<Impact> impact_of(const LinkedIsland& island, double time_s, const Touching& pair,
                                std::span<const BodyState> motions) {
  const BodyState* const b = is_static(pair.b) ? nullptr : &motions[island.place_of(pair.b)];
  ++island.counters.linked_searches;
  return time_of_impact(
      {island.scene, island.geometry, time_s, pair.a, motions[island.place_of(pair.a)], pair.b, b});
}

}  // namespace

bool is_wedged(const LinkedIsland& island) {
  constexpr double kGoodPart = 0.05;
  for (const ContactManifold& m : island.manifolds) {
    if (is_joint(m)) continue;
    double width = island.shape_of(island.place_of(m.a)).min_extent_m;
    if (!is_static(m.b))
      width = std::min(width, island.shape_of(island.place_of(m.b)).min_extent_m);
    for (std::uint32_t i = 0; i < m.count; ++i)
      if (m.points[i].separation_m < -kGoodPart * width) return true;
  }
  return false;
}

std::optional<double> first_unseen_s(const LinkedIsland& island, double time_s,
                                     std::span<const ContactManifold> manifolds,
                                     std::span<const BodyState> before,
                                     std::span<const BodyState> motions) {
  std::vector<bool> may_miss;
  for (std::size_t i = 0; i < motions.size(); ++i)
    may_miss.push_back(may_miss_pairs(island, time_s, i, before[i], motions[i]));
  if (std::find(may_miss.begin(), may_miss.end(), true) == may_miss.end()) return {};
  std::optional<double> first;
  for (const Touching& pair : query_swept_pairs(island, motions)) {
    const std::size_t a = island.place_of(pair.a);
    const BodyState* const b = is_static(pair.b) ? nullptr : &motions[island.place_of(pair.b)];
    if (!may_miss[a] && (b == nullptr || !may_miss[static_cast<std::size_t>(b - motions.data())]))
      continue;
    if (have_touched(manifolds, pair)) continue;
    const std::optional<Impact> impact = impact_of(island, time_s, pair, motions);
    if (impact && (!first || impact->time_s < *first)) first = impact->time_s;
  }
  return first;
}

std::optional<double> first_bounce_s(const LinkedIsland& island, double time_s,
                                     const BouncesInTime& located, std::optional<double> first_s,
                                     std::span<const BodyState> motions,
                                     std::vector<Touching>& held) {
  constexpr double kAtOnce = 1e-6;
  const Touching* pair = nullptr;
  for (const Touching& p : located.pairs) {
    const std::optional<Impact> impact = impact_of(island, time_s, p, motions);
    if (!impact || (first_s && impact->time_s >= *first_s)) continue;
    first_s = impact->time_s;
    pair = &p;
  }
  if (pair != nullptr && !(*first_s > kAtOnce * time_s)) held.push_back(*pair);
  return first_s;
}

std::vector<ContactManifold> contacts_now(const LinkedIsland& island, double time_s,
                                          std::span<const ContactManifold> before,
                                          std::span<const BodyState> states,
                                          std::span<const BodyState> motions) {
  std::vector<BodyState> drawn;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    drawn.push_back(states[i]);
    drawn[i].linear_velocity_m_s = motions[i].linear_velocity_m_s;
    drawn[i].angular_velocity_rad_s = motions[i].angular_velocity_rad_s;
  }
  std::vector<ContactManifold> found;
  const auto look = [&](const Touching& pair, std::span<const BodyState> at) {
    const BodyState* const b = is_static(pair.b) ? nullptr : &at[island.place_of(pair.b)];
    collide({island.scene, island.geometry, time_s, pair.a, at[island.place_of(pair.a)], pair.b, b},
            found, island.counters);
    std::erase_if(found, [](const ContactManifold& m) { return m.count == 0; });
  };
  std::vector<Touching> pairs = query_swept_pairs(island, states);
  if (!drawn.empty())
    for (const Touching& pair : query_swept_pairs(island, drawn)) pairs.push_back(pair);
  std::sort(pairs.begin(), pairs.end(), [](const Touching& x, const Touching& y) {
    return x.a < y.a || (x.a == y.a && x.b < y.b);
  });
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i > 0 && pairs[i].a == pairs[i - 1].a && pairs[i].b == pairs[i - 1].b) continue;
    const std::size_t count = found.size();
    look(pairs[i], states);
    if (found.size() == count && !drawn.empty()) look(pairs[i], drawn);
  }
  for (const ContactManifold& m : before)
    if (is_joint(m)) found.push_back(m);
  std::sort(found.begin(), found.end(), canonical_before);
  return found;
}

double relative_depth(const LinkedIsland& island, std::span<const ContactManifold> manifolds,
                      std::span<const BodyState> before, std::span<const BodyState> after,
                      std::span<const BodyState> motions, double time_s) {
  std::vector<double> displacement_m;
  for (std::size_t i = 0; i < after.size(); ++i)
    displacement_m.push_back((after[i].position_m - before[i].position_m).norm() +
                             island.shape_of(i).bounding_radius_m * time_s *
                                 motions[i].angular_velocity_rad_s.norm());
  const double counts = island.in_substeps ? kTooDeep : kVisible;
  double narrowest_m = island.shape_of(0).min_extent_m;
  for (std::size_t i = 1; i < after.size(); ++i)
    narrowest_m = std::min(narrowest_m, island.shape_of(i).min_extent_m);
  if (2.0 * std::ranges::max(displacement_m) <= counts * narrowest_m) return 0.0;
  double most = 0.0;
  for (const Touching& pair : query_swept_pairs(island, after)) {
    const std::size_t a = island.place_of(pair.a);
    const bool fixed = is_static(pair.b);
    const std::size_t b = fixed ? a : island.place_of(pair.b);
    const double width = std::min(island.shape_of(a).min_extent_m, island.shape_of(b).min_extent_m);
    const double sunk_m = displacement_m[a] + (fixed ? 0.0 : displacement_m[b]);  // at most
    if (sunk_m <= counts * width) continue;
    if (!fixed && !have_touched(manifolds, pair)) continue;
    const auto depth_m = [&](std::span<const BodyState> at) {
      return overlap_m(
          {island.scene, island.geometry, 0.0, pair.a, at[a], pair.b, fixed ? nullptr : &at[b]},
          island.counters);
    };
    const double depth = depth_m(after);
    if (depth > most * width) most = std::max(most, (depth - depth_m(before)) / width);
  }
  return most;
}

}  // namespace soda::physics
