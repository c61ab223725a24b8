#include "physics/integrators/end_contacts.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/narrowphase/part_pairs.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// What moves a body along, by its place in the island. A static stands still.
struct Carried {
  Vec3 centre_m = Vec3::Zero(), displacement_m = Vec3::Zero();
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
    point.position_m -=
        b != nullptr ? Vec3(0.5 * (a.displacement_m + b->displacement_m)) : a.displacement_m;
  }
}

bool is_pair_of(const ContactManifold& m, const ContactManifold& other) {
  return m.a == other.a && m.b == other.b;
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

// From where the step began, by the velocities that took it to where it is.
BodyState sent_from_start(std::size_t place, double dt_s, const IslandMove& move) {
  BodyState state = motion_of(move.start[place]);
  state.linear_velocity_m_s = (move.end[place].position_m - state.position_m) * (1.0 / dt_s);
  state.angular_velocity_rad_s = move.end[place].angular_velocity_rad_s;
  if (!move.push.empty()) state.angular_velocity_rad_s += move.push[place].angular;
  return state;
}

// Contacts are looked for along the path that a body begins with, its pushes, field and a margin
// included.
bool has_left_its_path(const IslandStep& island, const IslandMove& move, std::size_t place) {
  const BodyId id = island.ids[place];
  if (is_kinematic(island.scene, id)) return false;
  const double width_m = shape_of(island.scene, island.geometry, id).min_extent_m;
  const double fallen_m = field_of(island.scene, id).norm() * island.dt_s * island.dt_s;
  const SeenAhead ahead(island.scene, island.dt_s, id, move.start[place]);
  const BodyState& before = ahead.state();
  const Vec3 foreseen = before.position_m + island.dt_s * before.linear_velocity_m_s;
  const double most_m = kContactMargin * width_m + fallen_m;
  return (move.end[place].position_m - foreseen).squaredNorm() > most_m * most_m;
}

// What contacts found from the start on overlap at the end, >= 0.
double overlap_at_end_m(const IslandStep& island, const IslandMove& move,
                        std::span<const ContactManifold> contacts) {
  double overlap_m = 0.0;
  for (const ContactManifold& m : contacts) {
    const BodyState a = sent_from_start(place_of(island.ids, m.a), island.dt_s, move);
    const BodyState b = is_static(m.b)
                            ? BodyState{}
                            : sent_from_start(place_of(island.ids, m.b), island.dt_s, move);
    for (std::uint32_t i = 0; i < m.count; ++i) {
      Vec3 parting = -velocity_at(a, m.points[i].position_m);
      if (!is_static(m.b)) parting += velocity_at(b, m.points[i].position_m);
      const double gap_m = m.points[i].separation_m + island.dt_s * m.normal.dot(parting);
      overlap_m = std::max(overlap_m, -gap_m);
    }
  }
  return overlap_m;
}

// Of a pair that meets in parts and has the contacts from `known` on: those of other parts. Returns
// their overlap at the end.
double append_other_parts(const IslandStep& island, const IslandMove& move, std::size_t known,
                          StageCounters& counters, std::vector<ContactManifold>& contacts) {
  const ContactManifold pair = contacts[known];
  if (!meets_in_parts(island.scene, pair.a, pair.b)) return 0.0;
  if (!has_left_its_path(island, move, place_of(island.ids, pair.a)) &&
      (is_static(pair.b) || !has_left_its_path(island, move, place_of(island.ids, pair.b))))
    return 0.0;
  std::vector<ContactManifold> found;
  meet_on_path_m(island, move, pair, counters, found);
  const std::span<const ContactManifold> own = std::span(contacts).subspan(known);
  std::erase_if(found, [&](const ContactManifold& m) {
    return std::ranges::any_of(own, [&](const ContactManifold& o) { return o.part == m.part; });
  });
  const double overlap_m = overlap_at_end_m(island, move, found);
  contacts.insert(contacts.end(), found.begin(), found.end());
  std::sort(contacts.begin() + static_cast<std::ptrdiff_t>(known), contacts.end(),
            canonical_before);
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

Need sent_contacts_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  return {true, "contacts can send bodies on to others"};
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
  const double angular_speed_rad_s = std::max(move.start[body].angular_velocity_rad_s.norm(),
                                              move.end[body].angular_velocity_rad_s.norm());
  return angular_speed_rad_s * island.dt_s * shape.bounding_radius_m >
         kMostGrowth * shape.min_extent_m;
}

bool can_come_round(const IslandStep& island, const IslandMove& move) {
  bool any = false;
  for (std::size_t i = 0; i < island.ids.size() && !any; ++i) any = turns_far(island, move, i);
  return any;
}

double meet_on_path_m(const IslandStep& island, const IslandMove& move, const ContactManifold& pair,
                      StageCounters& counters, std::vector<ContactManifold>& contacts) {
  const bool fixed = is_static(pair.b);
  if (is_kinematic(island.scene, pair.a) || (!fixed && is_kinematic(island.scene, pair.b)))
    return 0.0;
  const std::size_t a = place_of(island.ids, pair.a), b = fixed ? a : place_of(island.ids, pair.b);
  const BodyState from_a = sent_from_start(a, island.dt_s, move),
                  from_b = sent_from_start(b, island.dt_s, move);
  const std::size_t known = contacts.size();
  collide({island.scene, island.geometry, island.dt_s, pair.a, from_a, pair.b,
           fixed ? nullptr : &from_b},
          contacts, counters);
  ++counters.unseen_searches;
  return overlap_at_end_m(island, move, std::span(contacts).subspan(known));
}

bool add_unseen_statics(const IslandStep& island, const IslandMove& move, StageCounters& counters,
                        std::vector<ContactManifold>& contacts) {
  bool sent = std::ranges::any_of(contacts, is_link);
  if (island.scene.statics.empty()) return sent;
  std::vector<IndexPair> pairs;
  std::vector<ContactManifold> links;
  for (std::size_t i = 0; i < island.ids.size(); ++i) {
    if (!has_left_its_path(island, move, i)) continue;
    ContactManifold link;
    link.a = island.ids[i];
    const Aabb box =
        swept_aabb(island.scene, island.geometry, link.a, sent_from_start(i, island.dt_s, move));
    find_static_pairs(island.geometry, {&box, 1}, pairs, counters);
    for (const IndexPair& pair : pairs) {
      link.b = static_id(pair.second);
      if (!groups_touch(island.scene, link.a, link.b)) continue;
      const auto at = std::ranges::lower_bound(contacts, link, canonical_before);
      if (at == contacts.end() || !is_pair_of(*at, link))
        links.push_back(link);
      else
        sent = sent || meets_in_parts(island.scene, link.a, link.b);
    }
  }
  contacts.insert(contacts.end(), links.begin(), links.end());
  if (!links.empty()) std::ranges::sort(contacts, canonical_before);
  return sent || !links.empty();
}

namespace {

// Of a pair that had no contact at the start. What it was solved with goes on to, as above.
double meet_again(const IslandStep& island, const IslandMove& move,
                  std::span<const ContactManifold> solved, StageCounters& counters,
                  std::vector<ContactManifold>& contacts) {
  const std::size_t known = contacts.size();
  const double overlap_m = meet_on_path_m(island, move, solved.front(), counters, contacts);
  for (std::size_t m = known; m < contacts.size(); ++m)
    for (const ContactManifold& before : solved) keep_held(before, contacts[m]);
  return overlap_m;
}

// Of a body's size: whoever is as deep in another has no side on which it should be.
constexpr double kBuried = 0.5;

}  // namespace

double find_end_contacts(const IslandStep& island, const IslandMove& move, bool round,
                         StageCounters& counters, std::vector<ContactManifold>& contacts) {
  const std::vector<ContactManifold> solved = std::exchange(contacts, {});
  double most_growth = 0.0;
  auto before = island.manifolds.begin();
  for (auto first = solved.begin(), last = first; first != solved.end(); first = last) {
    const auto of_pair = [&](const ContactManifold& m) { return is_pair_of(m, *first); };
    last = std::find_if_not(first, solved.end(), of_pair);
    double before_m = 0.0, after_m = 0.0;
    bool sent = true;  // whoever had no contact at the start
    for (; before != island.manifolds.end() && of_pair(*before); ++before) {
      before_m = std::max(before_m, -least_separation_m(*before));
      sent = sent && is_link(*before);
    }
    const std::size_t known = contacts.size();
    if (is_joint(*first) || before_m >= kBuried * size_of(island.scene, *first)) {
      contacts.insert(contacts.end(), first, last);
      continue;
    }
    if (sent)
      after_m = meet_again(island, move, std::span(first, last), counters, contacts);
    else if (round)
      after_m = append_at_end(island, move, std::span(first, last), counters, contacts);
    if (contacts.size() == known) contacts.insert(contacts.end(), first, last);
    if (!sent)
      after_m = std::max(after_m, append_other_parts(island, move, known, counters, contacts));
    most_growth = std::max(most_growth, (after_m - before_m) / size_of(island.scene, *first));
  }
  return most_growth;
}

}  // namespace soda::physics
