#include "physics/events/linked_step.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "physics/constraints/joint_rows.hpp"
#include "physics/continuous/time_of_impact.hpp"
#include "physics/events/linked_impacts.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/refinement/advance_resting.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// Parts have faults of their own.
struct LinkedIsland : IslandStep {
  SolveScratch& scratch;
  StageCounters& counters;
  bool wedged = false;  // something overlaps by a good part of its width: little does not count
  bool swept = false;   // its joints are: parts of a step would cost more than they are worth

  const CompiledShape& shape_of(std::size_t body) const {
    return geometry.impl().shapes[scene.bodies[index_of(ids[body])].shape].shape;
  }
  std::size_t place_of(BodyId id) const { return physics::place_of(ids, id); }
};

// The rotation vector that leads from one orientation to another, up to half a turn. To a
// hundredth: it says where to look, not where things are.
Vec3 rotation_between(const Quat& from, const Quat& to) {
  const Quat rotation = to * from.conjugate();
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const double quarter = rotation.vec().norm() / (1.0 + sign * rotation.w());  // its tangent
  if (!(quarter > 0.0)) return Vec3::Zero();
  const double squared = quarter * quarter;
  const double angle = 4.0 * quarter * (15.0 + 4.0 * squared) / (15.0 + 9.0 * squared);
  return rotation.vec() * (sign * angle / rotation.vec().norm());
}

// Free flight from where a part began to where it ended.
BodyState motion_between(const Vec3& field_m_s2, double time_s, const BodyState& before,
                         const BodyState& after) {
  BodyState start;
  start.broken_joints = before.broken_joints;
  start.position_m = before.position_m;
  start.orientation = before.orientation;
  start.linear_velocity_m_s =
      (after.position_m - before.position_m) / time_s - field_m_s2 * (0.5 * time_s);
  start.angular_velocity_rad_s = rotation_between(before.orientation, after.orientation) / time_s;
  return start;
}

constexpr double kTooDeep = 0.5;  // that a body may sink in a part, of its width
constexpr double kVisible = 0.001;

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

// When the first pair without manifold touches, in the motions that the bodies made in `time_s`.
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

// The first of them to touch, if before `first_s`. One that does so at once, and does not come near
// fast enough to bounce, is noted as held: it is a row from now on.
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

// Where the bodies are now: along their own velocities, and where that finds none in the motions
// that the joints gave them.
std::vector<ContactManifold> contacts_now(const LinkedIsland& island, double time_s,
                                          std::span<const ContactManifold> before,
                                          std::span<const BodyState> states,
                                          std::span<const BodyState> motions) {
  std::vector<BodyState> drawn(states.begin(), states.end());
  for (std::size_t i = 0; i < drawn.size(); ++i) {
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
  for (const Touching& pair : query_swept_pairs(island, drawn)) pairs.push_back(pair);
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
// count. Pairs that did not come far enough for what is looked for are left out, and those of
// bodies that have no manifold: these are looked for on the way.
double relative_depth(const LinkedIsland& island, std::span<const ContactManifold> manifolds,
                      std::span<const BodyState> before, std::span<const BodyState> after,
                      std::span<const BodyState> motions, double time_s) {
  std::vector<double> displacement_m;
  for (std::size_t i = 0; i < after.size(); ++i)
    displacement_m.push_back((after[i].position_m - before[i].position_m).norm() +
                             island.shape_of(i).bounding_radius_m * time_s *
                                 motions[i].angular_velocity_rad_s.norm());
  double most = 0.0;
  for (const Touching& pair : query_swept_pairs(island, after)) {
    const std::size_t a = island.place_of(pair.a);
    const bool fixed = is_static(pair.b);
    const std::size_t b = fixed ? a : island.place_of(pair.b);
    const double width = std::min(island.shape_of(a).min_extent_m, island.shape_of(b).min_extent_m);
    const double sunk_m = displacement_m[a] + (fixed ? 0.0 : displacement_m[b]);  // at most
    if (sunk_m <= (island.wedged || island.swept ? kTooDeep : kVisible) * width) continue;
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

struct LinkedPart {
  IslandReport report;
  std::vector<AdvanceFault> faults;
  std::vector<BodyState> motions;  // that the bodies made
  double relative_depth = 0.0;
};

LinkedPart advance_part(const LinkedIsland& island, double time_s,
                        std::span<const ContactManifold> manifolds,
                        std::span<const BodyState> before, std::span<BodyState> states) {
  LinkedPart part;
  std::copy(before.begin(), before.end(), states.begin());
  if (time_s > 0.0)
    part.report = advance_resting(island.over(time_s, manifolds), states,
                                  {island.scratch, island.counters, part.faults});
  for (std::size_t i = 0; i < states.size(); ++i)
    part.motions.push_back(motion_between(field_of(island.scene, island.ids[i]),
                                          std::max(time_s, 1e-300), before[i], states[i]));
  part.relative_depth = relative_depth(island, manifolds, before, states, part.motions, time_s);
  return part;
}

// What a part of its length sinks by is of second order in it. A little is worth a few halvings of
// the first parts, where much is worth more.
bool is_to_be_halved(const LinkedIsland& island, const LinkedPart& part, int halvings, int number) {
  constexpr int kForVisible = 3, kForDeep = 8, kFirstParts = 8;
  if (part.relative_depth > kTooDeep) return halvings < kForDeep;
  return !island.wedged && !island.swept && part.relative_depth > kVisible &&
         halvings < kForVisible && number < kFirstParts;
}

// As before, but for the velocities: they are those found, with no more energy than there was.
void stay_at(const LinkedIsland& island, std::span<const BodyState> before,
             std::span<BodyState> states, IslandReport& report) {
  report.push_out_work_joule = report.motor_work_joule = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    states[i].position_m = before[i].position_m;
    states[i].orientation = before[i].orientation;
  }
  const double had = kinetic_joule(island.scene, island.ids, before);
  const double has = kinetic_joule(island.scene, island.ids, states);
  if (!(has > had)) return;
  // What it waits at takes the rest.
  const double share = std::sqrt(had / has);
  const IslandMomentum whole = momentum_of(island.scene, island.ids, states);
  const Vec3 taken = whole.linear_newton_s * (share - 1.0);
  report.static_impulse_newton_s += taken;
  report.static_angular_impulse_newton_m_s +=
      whole.centre_m.cross(taken) + whole.angular_newton_m_s * (share - 1.0);
  for (BodyState& state : states) {
    state.linear_velocity_m_s *= share;
    state.angular_velocity_rad_s *= share;
  }
}

// The time that is not used takes no weight away: what the island waits at bears it.
void wait_for(double time_s, const LinkedIsland& island, IslandReport& report) {
  report.beyond_tolerance = island.scene.tolerance > 0.0;
  for (const BodyId id : island.ids)
    if (falls(island.scene, id))
      report.static_impulse_newton_s -=
          field_of(island.scene, id) * (island.scene.bodies[index_of(id)].mass_kg * time_s);
}

// What drives, thrusters and damping give the bodies, as measures know it of a whole step.
Vec3 pushed_newton_s(const LinkedIsland& island, double time_s, std::span<const BodyState> states) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < states.size(); ++i)
    if (is_pushed(island.scene.bodies[index_of(island.ids[i])]))
      sum += push_impulse_newton_s(island.scene, time_s, island.ids[i], states[i]);
  return sum;
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

IslandReport advance_linked(const IslandStep& step, std::span<BodyState> states,
                            const IslandEffects& effects) {
  constexpr int kMostPartsOfStep = 8, kMostPartsThatBounce = 5;
  if (step.ids.size() == 1 && step.scene.statics.empty())  // there is nothing to come to
    return advance_resting(step, states, effects);
  LinkedIsland island{step, effects.scratch, effects.counters};
  island.wedged = is_wedged(island);
  const Vec3 foreseen = pushed_newton_s(island, step.dt_s, states);
  Vec3 pushed = Vec3::Zero();
  IslandReport report;
  report.label = step.ids.front();
  report.bodies = static_cast<std::uint32_t>(step.ids.size());
  std::vector<ContactManifold> found;
  std::span<const ContactManifold> met = step.manifolds;
  std::vector<Touching> held;
  IslandReport bounces;
  const bool can_bounce = !island.wedged && bounce_in_time(island, states);
  double left_s = step.dt_s;
  const auto look = [&](std::span<const BodyState> at, std::span<const BodyState> motions) {
    found = contacts_now(island, left_s, met, at, motions);
    met = found;
  };
  for (int number = 0;; ++number) {
    if (can_bounce && resolve_linked_impacts(island, met, states, bounces, island.counters))
      look(states, states);
    const BouncesInTime located = can_bounce && number < kMostPartsThatBounce
                                      ? find_bounces_in_time(island, met, held, states)
                                      : BouncesInTime{};
    if (!located.pairs.empty()) met = located.others;
    const std::vector<BodyState> before(states.begin(), states.end());
    const std::uint64_t swept = island.counters.joint_sweeps;
    LinkedPart part = advance_part(island, left_s, met, before, states);
    island.swept = island.counters.joint_sweeps > swept;
    const std::optional<double> touch_s = first_bounce_s(
        island, left_s, located, first_unseen_s(island, left_s, met, before, part.motions),
        part.motions, held);
    const std::vector<BodyState> motions = part.motions;
    double time_s = touch_s ? *touch_s : left_s;
    if (touch_s && island.swept) {
      time_s = left_s;
      look(before, part.motions);
    }
    if (touch_s) part = advance_part(island, time_s, met, before, states);
    for (int halvings = 0; is_to_be_halved(island, part, halvings, number); ++halvings) {
      time_s *= 0.5;
      part = advance_part(island, time_s, met, before, states);
    }
    if (have_missed_one(island, located.pairs, before, states)) {
      held.insert(held.end(), located.pairs.begin(), located.pairs.end());
      std::copy(before.begin(), before.end(), states.begin());
      look(states, motions);
      continue;
    }
    const bool sunk = part.relative_depth > kTooDeep;
    if (sunk) stay_at(island, before, states, part.report);
    effects.faults.insert(effects.faults.end(), part.faults.begin(), part.faults.end());
    if (number == 0 && time_s > 0.0)
      report = part.report;
    else
      add_part(part.report, report);
    pushed += pushed_newton_s(island, time_s, before);
    left_s -= time_s;
    const bool waits = left_s > 0.0 && (sunk || number + 1 == kMostPartsOfStep);
    if (waits) wait_for(left_s, island, report);
    if (waits || !(left_s > 0.0)) break;
    look(states, motions);
  }
  report.static_impulse_newton_s += pushed - foreseen;
  add_bounces(bounces, report);
  return report;
}

}  // namespace soda::physics
