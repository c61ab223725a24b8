#include "physics/integrators/end_contacts.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "physics/model/body_places.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// What moves a body along, by its place in the island. A static stands still.
struct Carried {
  Vec3 centre_m = Vec3::Zero(), way_m = Vec3::Zero();
  Vec3 linear_m_s = Vec3::Zero(), angular_rad_s = Vec3::Zero();

  Vec3 velocity_at(const Vec3& point_m) const {
    return linear_m_s + angular_rad_s.cross(point_m - centre_m);
  }
};

Carried carried(std::size_t place, const IslandMove& move) {
  const BodyState& state = move.end[place];
  Carried body{state.position_m, state.position_m - move.start[place].position_m,
               state.linear_velocity_m_s, state.angular_velocity_rad_s};
  if (move.push.empty()) return body;
  body.linear_m_s += move.push[place].linear;
  body.angular_rad_s += move.push[place].angular;
  return body;
}

// The points that held it so far go on to, as far as there is room: or what one solve lifts another
// lets sink, by turns. `held`: a manifold of the same surfaces.
void keep_held(const ContactManifold& held, ContactManifold& m) {
  constexpr double kAlike = 0.99;  // cosine of the angle between their normals
  if (held.part != m.part || held.normal.dot(m.normal) < kAlike) return;
  const std::uint32_t found = m.count;
  for (std::uint32_t i = 0; i < held.count && m.count < m.points.size(); ++i) {
    const auto same = [&](const ContactPoint& point) {
      return point.feature == held.points[i].feature;
    };
    if (std::none_of(m.points.begin(), m.points.begin() + found, same))
      m.points[m.count++] = held.points[i];
  }
  std::sort(m.points.begin(), m.points.begin() + m.count,
            [](const ContactPoint& x, const ContactPoint& y) { return x.feature < y.feature; });
}

bool is_ball(const SceneDescription& scene, BodyId id) {
  return std::holds_alternative<Sphere>(scene.shapes[scene.bodies[index_of(id)].shape]);
}

// Where it was, and how near.
void take_back(const Carried& a, const Carried* b, double dt_s, ContactManifold& m) {
  for (std::uint32_t i = 0; i < m.count; ++i) {
    ContactPoint& point = m.points[i];
    Vec3 parting = -a.velocity_at(point.position_m);
    if (b != nullptr) parting += b->velocity_at(point.position_m);
    point.separation_m -= dt_s * m.normal.dot(parting);
    point.position_m -= b != nullptr ? Vec3(0.5 * (a.way_m + b->way_m)) : a.way_m;
  }
}

// A pair's contacts at the end, taken back; those that it has `held`, if there are none. Returns
// its overlap at the end.
double append_at_end(const IslandStep& island, const IslandMove& move,
                     std::span<const ContactManifold> held, StageCounters& counters,
                     std::vector<ContactManifold>& contacts) {
  const BodyId id_a = held.front().a, id_b = held.front().b;
  const bool fixed = is_static(id_b);
  const std::size_t a = place_of(island.ids, id_a), b = fixed ? a : place_of(island.ids, id_b);
  const std::size_t known = contacts.size();
  collide(
      {island.scene, island.geometry, 0.0, id_a, move.end[a], id_b, fixed ? nullptr : &move.end[b]},
      contacts, counters);
  ++counters.turned_searches;
  if (contacts.size() == known) {
    contacts.insert(contacts.end(), held.begin(), held.end());
    return 0.0;
  }
  const Carried of_a = carried(a, move), of_b = carried(b, move);
  double overlap_m = 0.0;
  for (std::size_t m = known; m < contacts.size(); ++m) {
    overlap_m = std::max(overlap_m, -least_separation_m(contacts[m]));
    take_back(of_a, fixed ? nullptr : &of_b, island.dt_s, contacts[m]);
    for (const ContactManifold& before : held) keep_held(before, contacts[m]);
  }
  return overlap_m;
}

}  // namespace

Need end_contacts_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  const bool other = std::ranges::any_of(scene.bodies, [&](const BodyParams& body) {
    return !std::holds_alternative<Sphere>(scene.shapes[body.shape]);
  });
  return need_of(other, "solids that turn show other points", "balls show no other points");
}

int most_end_solves(std::size_t points) {
  constexpr std::size_t kMost = 3, kPointsSolved = 384;
  return static_cast<int>(
      std::clamp(kPointsSolved / std::max<std::size_t>(points, 1), std::size_t{1}, kMost));
}

bool shows_other_points(const SceneDescription& scene, std::span<const BodyId> ids) {
  return !std::ranges::all_of(ids, [&](BodyId id) { return is_ball(scene, id); }) &&
         !any_kinematic(scene, ids);
}

bool turns_far(const IslandStep& island, const IslandMove& move, std::size_t body) {
  const BodyId id = island.ids[body];
  if (is_ball(island.scene, id)) return false;
  const CompiledShape& shape = shape_of(island.scene, island.geometry, id);
  const double spin_rad_s = std::max(move.start[body].angular_velocity_rad_s.norm(),
                                     move.end[body].angular_velocity_rad_s.norm());
  return spin_rad_s * island.dt_s * shape.bounding_radius_m > kMostGrowth * shape.min_extent_m;
}

bool can_come_round(const IslandStep& island, const IslandMove& move) {
  bool any = false;
  for (std::size_t i = 0; i < island.ids.size() && !any; ++i) any = turns_far(island, move, i);
  return any;
}

double find_end_contacts(const IslandStep& island, const IslandMove& move, StageCounters& counters,
                         std::vector<ContactManifold>& contacts) {
  const std::span<const ContactManifold> manifolds = island.manifolds;
  const std::vector<ContactManifold> solved = std::exchange(contacts, {});
  double most_growth = 0.0;
  auto held = solved.begin();
  for (auto first = manifolds.begin(), last = first; first != manifolds.end(); first = last) {
    const auto of_pair = [&](const ContactManifold& m) {
      return m.a == first->a && m.b == first->b;
    };
    double before_m = 0.0;
    for (; last != manifolds.end() && of_pair(*last); ++last)
      before_m = std::max(before_m, -least_separation_m(*last));
    const auto first_held = held;
    while (held != solved.end() && of_pair(*held)) ++held;
    if (is_joint(*first)) {
      contacts.insert(contacts.end(), first_held, held);
      continue;
    }
    const double after_m =
        append_at_end(island, move, std::span(first_held, held), counters, contacts);
    most_growth = std::max(most_growth, (after_m - before_m) / size_of(island.scene, *first));
  }
  return most_growth;
}

}  // namespace soda::physics
