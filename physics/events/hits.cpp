#include "physics/events/hits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "physics/integrators/advance_once.hpp"
#include "physics/refinement/advance_resting.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/forces/forces.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/broadphase/reach.hpp"
#include "physics/refinement/refined_trials.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/events/strike.hpp"
#include "physics/continuous/time_of_impact.hpp"

namespace soda::physics {
namespace {

constexpr std::size_t kMostHitBodies = 8;
constexpr double kNever = std::numeric_limits<double>::infinity();

// Of the width. A gap counts as none, and points hit together. A body that rests is tilted by what
// its solver leaves: a face that comes to a face by less than that is meant to hit as one.
constexpr double kTouching = 1e-9, kTogether = 1e-4;

constexpr double kForeseenTurn_rad = 0.25;

struct HitIsland {
  const SceneDescription& scene;
  const Geometry& geometry;
  std::span<const BodyId> ids;

  template <typename State>
  State& state_of(BodyId id, std::span<State> states) const {
    return states[static_cast<std::size_t>(std::lower_bound(ids.begin(), ids.end(), id) -
                                           ids.begin())];
  }
  bool bounces(const ContactManifold& m) const {
    return std::max(material_of(scene, m.a).restitution, material_of(scene, m.b).restitution) > 0.0;
  }
  double width_m(const ContactManifold& m) const {
    const double a = shape_of(scene, geometry, m.a).min_extent_m;
    return is_static(m.b) ? a : std::min(a, shape_of(scene, geometry, m.b).min_extent_m);
  }
  // The largest approach at a point of this pair that is no hit.
  double slow_m_s(const ContactManifold& m) const {
    constexpr double kSteps = 2.0;  // as of what can be smooth (refined_parts.cpp)
    double slow = bounces(m) ? scene.solver.restitution_threshold_m_s : kNever;
    if (scene.tolerance > 0.0)
      slow = std::min(slow, kSteps * scene.gravity_m_s2.norm() * scene.dt_s +
                                kTogether * width_m(m) / scene.dt_s);
    return slow;
  }
  // How fast the surfaces come nearer at the point.
  double approach_m_s(const ContactManifold& m, const ContactPoint& p,
                      std::span<const BodyState> states) const {
    const Vec3 of_a = velocity_at(state_of(m.a, states), p.position_m);
    const Vec3 of_b =
        is_static(m.b) ? Vec3(Vec3::Zero()) : velocity_at(state_of(m.b, states), p.position_m);
    return (of_a - of_b).dot(m.normal);
  }
};

// By how much what pushes a body besides gravity can change the velocity of any of its points.
double pushed_m_s2(const HitIsland& island, BodyId id, const BodyState& state) {
  const SceneDescription& scene = island.scene;
  const BodyParams& body = scene.bodies[index_of(id)];
  double most = body.drive == kNoDrive ? 0.0 : scene.drives[body.drive].max_acceleration_m_s2;
  if (body.forces == kNone) return most;
  const BodyForces& own = scene.forces[body.forces];
  const double turned = body.inverse_inertia_local.norm() * own.torque_newton_m.norm() +
                        own.angular_damping_1_s * state.angular_velocity_rad_s.norm();
  most += (own.force_newton.norm() + own.body_force_newton.norm()) / body.mass_kg;
  most += own.linear_damping_1_s * state.linear_velocity_m_s.norm();
  return most + turned * shape_of(scene, island.geometry, id).bounding_radius_m;
}

// How fast two bodies can come nearer along the normal, and how much faster that can get: by
// gravity, pushes, and as much friction, of both.
struct Nearing {
  double centres_m_s = 0.0;   // but for their spin
  double turning_m_s = 0.0;   // of the points that spin moves fastest, of both
  double turning_m_s2 = 0.0;  // they go in circles
  double pulled_m_s2 = 0.0;
};

Nearing nearing_of(const HitIsland& island, const ContactManifold& m,
                   std::span<const BodyState> states) {
  Nearing nearing{.pulled_m_s2 = 4.0 * island.scene.gravity_m_s2.norm()};
  for (const BodyId id : {m.a, m.b}) {
    if (is_static(id)) continue;
    const BodyState& state = island.state_of(id, states);
    const double speed = state.linear_velocity_m_s.dot(m.normal);
    nearing.centres_m_s += id == m.a ? speed : -speed;
    nearing.pulled_m_s2 += 2.0 * pushed_m_s2(island, id, state);
    const CompiledShape& shape = shape_of(island.scene, island.geometry, id);
    if (shape.kind == ShapeKind::kSphere) continue;
    const double spin = state.angular_velocity_rad_s.norm();
    nearing.turning_m_s += spin * shape.bounding_radius_m;
    nearing.turning_m_s2 += spin * spin * shape.bounding_radius_m;
  }
  return nearing;
}

double time_over_s(double gap_m, double speed_m_s, double faster_m_s2) {
  const double meeting = std::sqrt(speed_m_s * speed_m_s + 2.0 * faster_m_s2 * gap_m);
  return 2.0 * gap_m / (speed_m_s + meeting);
}

// For how long nothing is hit: 0 if something is now. Two bodies are apart as long as there is a
// gap along any direction: that along the normal closes at the speed of the centres, and as fast as
// spins can move points that are not known yet. Where it is small, its own points close it.
double clear_s(const HitIsland& island, std::span<const ContactManifold> contacts,
               std::span<const BodyState> states) {
  constexpr double kSmall = 0.01;  // of the width
  double clear = kNever;
  for (const ContactManifold& m : contacts) {
    const double slow = island.slow_m_s(m);
    if (is_joint(m) || slow == kNever) continue;
    const Nearing nearing = nearing_of(island, m, states);
    const double width = island.width_m(m);
    for (std::uint32_t i = 0; i < m.count; ++i) {
      const double approach = island.approach_m_s(m, m.points[i], states);
      if (!(approach > slow)) continue;
      const double gap = m.points[i].separation_m;
      if (gap <= kTouching * width) return 0.0;
      const double time =
          gap > kSmall * width
              ? time_over_s(gap, nearing.centres_m_s + nearing.turning_m_s, nearing.pulled_m_s2)
              : time_over_s(gap, approach, nearing.pulled_m_s2 + nearing.turning_m_s2);
      clear = std::min(clear, time);
    }
  }
  return clear;
}

// For how long the points that are nearest tell of what comes near: until something has turned by a
// quarter radian. After a hit, what spins may come round and hit again.
double foreseen_s(const HitIsland& island, std::span<const ContactManifold> contacts,
                  std::span<const BodyState> states) {
  double foreseen = kNever;
  for (const ContactManifold& m : contacts) {
    if (is_joint(m) || island.slow_m_s(m) == kNever) continue;
    for (const BodyId id : {m.a, m.b}) {
      if (is_static(id) || shape_of(island.scene, island.geometry, id).kind == ShapeKind::kSphere)
        continue;
      const double spin = island.state_of(id, states).angular_velocity_rad_s.norm();
      if (spin > 0.0) foreseen = std::min(foreseen, kForeseenTurn_rad / spin);
    }
  }
  return foreseen;
}

// The contacts without points that come nearer for a hit: until then these have no part in it.
// Solvers would slow them down before, as soon as they are within reach of one more of their steps;
// and what they pressed with in the step before would have them held at the distance that they are
// at (try_steps).
std::vector<ContactManifold> without_hits(const HitIsland& island,
                                          std::span<const ContactManifold> contacts,
                                          std::span<BodyState> states) {
  std::vector<ContactManifold> kept;
  for (const ContactManifold& contact : contacts) {
    const double slow = island.slow_m_s(contact);
    ContactManifold m = contact;
    m.count = 0;
    for (std::uint32_t i = 0; i < contact.count; ++i) {
      const ContactPoint& p = contact.points[i];
      if (island.approach_m_s(m, p, states) > slow)
        std::erase_if(island.state_of(m.a, states).impulses, [&](const ContactImpulse& impulse) {
          return impulse.other == m.b && impulse.part == m.part && impulse.feature == p.feature;
        });
      else
        m.points[m.count++] = p;
    }
    if (m.count > 0) kept.push_back(m);
  }
  return kept;
}

std::size_t most_parts(std::span<const BodyId> ids) { return 8 + 8 * ids.size(); }

// Sweeps, which solve what bounces, do not get anywhere with a grain between a block that is that
// much heavier and the floor: it whirls, and is thrown. Without rebounds it is held. And what
// whirls so fast that no number of parts would show where it hits is not looked at.
bool can_be_hit(const HitIsland& island, double dt_s, std::span<const BodyState> states) {
  constexpr double kMostRatio = 1e4;
  if (island.ids.size() > kMostHitBodies) return false;
  const double most_turn_rad = kForeseenTurn_rad * static_cast<double>(most_parts(island.ids));
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!is_unjointed(island.scene.bodies[index_of(island.ids[i])])) return false;
    if (shape_of(island.scene, island.geometry, island.ids[i]).kind == ShapeKind::kSphere) continue;
    if (states[i].angular_velocity_rad_s.norm() * dt_s > most_turn_rad) return false;
  }
  return mass_ratio(island.scene, island.ids) <= kMostRatio;
}

// What is hit now, and what is held meanwhile: points that touch, with no gap left.
std::vector<ContactManifold> touching_points(const HitIsland& island,
                                             std::span<const ContactManifold> contacts,
                                             std::span<const BodyState> states) {
  std::vector<ContactManifold> touching;
  for (const ContactManifold& contact : contacts) {
    ContactManifold m = contact;
    const double together = kTogether * island.width_m(m), slow = island.slow_m_s(m);
    bool is_hit = false;
    m.count = 0;
    for (std::uint32_t i = 0; i < contact.count; ++i) {
      ContactPoint p = contact.points[i];
      if (p.separation_m > together) continue;
      is_hit = is_hit || island.approach_m_s(m, p, states) > slow;
      p.separation_m = std::min(p.separation_m, 0.0);
      m.points[m.count++] = p;
    }
    if (m.count > 0 && (is_hit || is_static(m.b) || !island.bounces(m))) touching.push_back(m);
  }
  return touching;
}

// From hit to hit. `clear`: how long there is none.
void advance_through(const HitIsland& island, double dt_s, double clear,
                     std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                     IslandReport& report, SolveScratch& scratch, StageCounters& counters,
                     std::vector<AdvanceFault>& faults) {
  const auto& [scene, geometry, ids] = island;
  // A step that short is off by less than what refinement is content with.
  constexpr double kShort = 0.01;
  const auto advance = [&](double time_s, std::span<const ContactManifold> contacts) {
    report.static_impulse_newton_s += push_impulses_newton_s(scene, time_s, ids, states);
    const bool short_enough = !(scene.tolerance > 0.0) && time_s <= kShort * scene.dt_s;
    const auto advance_part = short_enough ? advance_unrefined : advance_resting;
    add_part(
        advance_part(scene, geometry, time_s, ids, contacts, states, scratch, counters, faults),
        report);
  };
  std::vector<ContactManifold> pairs, found(manifolds.begin(), manifolds.end());
  if (clear < dt_s) pairs = pairs_to_look_at(scene, geometry, dt_s, ids, states, counters);
  double left_s = dt_s;
  for (std::size_t i = 0; i < most_parts(ids) && clear < left_s; ++i) {
    if (clear > 0.0) {
      advance(clear, without_hits(island, found, states));
      left_s -= clear;
    } else if (!strike(scene, ids, touching_points(island, found, states), states, report,
                       counters)) {
      break;
    }
    find_again(scene, geometry, left_s, ids, pairs, states, counters, found);
    counters.hit_searches += pairs.size();
    clear = std::min(clear_s(island, found, states), foreseen_s(island, found, states));
  }
  if (clear < left_s)
    advance(left_s, found);
  else
    advance(left_s, without_hits(island, found, states));
}

}  // namespace

Need hits_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  if (!can_meet(bodies_that(scene, is_unjointed), scene.statics.size()))
    return {false, "joints hold the bodies that can touch"};
  if (scene.tolerance > 0.0) return {true, "contacts are resolved to a tolerance"};
  const auto springy = [](const auto& body) { return body.material.restitution > 0.0; };
  const bool bounces =
      statics_that(scene, springy) > 0 || bodies_that(scene, [&](const BodyParams& body) {
                                            return is_unjointed(body) && springy(body);
                                          }) > 0;
  return need_of(bounces, "a material has restitution > 0",
                 "nothing without joints has restitution > 0");
}

std::optional<AmongHits> advance_among_hits(const SceneDescription& scene, const Geometry& geometry,
                                            double dt_s, std::span<const BodyId> ids,
                                            std::span<const ContactManifold> manifolds,
                                            std::span<BodyState> states, SolveScratch& scratch,
                                            StageCounters& counters,
                                            std::vector<AdvanceFault>& faults) {
  const HitIsland island{scene, geometry, ids};
  const double clear =
      can_be_hit(island, dt_s, states) ? clear_s(island, manifolds, states) : kNever;
  if (clear == kNever) return {};
  AmongHits result;
  result.hit = clear < dt_s;
  result.report.label = ids.front();
  result.report.bodies = static_cast<std::uint32_t>(ids.size());
  // Measures know what pushes give in a step from its start on; parts start elsewhere.
  result.report.static_impulse_newton_s = -push_impulses_newton_s(scene, dt_s, ids, states);
  advance_through(island, dt_s, clear, manifolds, states, result.report, scratch, counters, faults);
  if (scene.tolerance > 0.0 && result.report.error_estimate > scene.tolerance)
    result.report.beyond_tolerance = true;
  return result;
}

}  // namespace soda::physics
