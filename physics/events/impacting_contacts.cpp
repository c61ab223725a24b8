#include "physics/events/impacting_contacts.hpp"

#include <cmath>

#include "physics/events/meeting_pairs.hpp"
#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// Of the width. A gap counts as none, and points of a pair hit together: a body that rests is
// tilted by what its solver leaves, so a face that comes to a face by less is meant to hit as one.
constexpr double kTouching = 1e-9, kTogether = 1e-4;

}  // namespace

ContactImpactIsland::ContactImpactIsland(const IslandStep& step)
    : IslandStep(step),
      sends_(std::ranges::any_of(manifolds, is_link)),
      strongest_field_m_s2_(physics::strongest_field_m_s2(scene, ids)) {}

bool ContactImpactIsland::bounces(const ContactManifold& m) const {
  return std::max(material_of(scene, m.a).restitution, material_of(scene, m.b).restitution) > 0.0;
}

double ContactImpactIsland::width_m(const ContactManifold& m) const {
  return width_of(scene, geometry, m.a, m.b);
}

double ContactImpactIsland::slow_m_s(const ContactManifold& m) const {
  constexpr double kSteps = 2.0;  // as of what can be smooth (sub_intervals.cpp)
  double slow = bounces(m) ? scene.solver.restitution_threshold_m_s : kNever;
  if (scene.tolerance > 0.0 || sends_)
    slow = std::min(
        slow, kSteps * strongest_field_m_s2_ * scene.dt_s + kTogether * width_m(m) / scene.dt_s);
  return slow;
}

double ContactImpactIsland::approach_m_s(const ContactManifold& m, const ContactPoint& p,
                                         std::span<const BodyState> states) const {
  const Vec3 of_a = velocity_at(state_of(m.a, states), p.position_m);
  const Vec3 of_b =
      is_static(m.b) ? Vec3(Vec3::Zero()) : velocity_at(state_of(m.b, states), p.position_m);
  return (of_a - of_b).dot(m.normal);
}

double pushed_m_s2(const ContactImpactIsland& island, BodyId id, const BodyState& state) {
  const SceneDescription& scene = island.scene;
  const BodyParams& body = scene.bodies[index_of(id)];
  double most = most_push_m_s2(scene, body);
  if (body.forces == kNone) return most;
  const BodyForces& own = scene.forces[body.forces];
  const double turned = most_twist_rad_s2(scene, body) +
                        own.angular_damping_1_s * state.angular_velocity_rad_s.norm();
  most += own.linear_damping_1_s * state.linear_velocity_m_s.norm();
  return most + turned * shape_of(scene, island.geometry, id).bounding_radius_m;
}

namespace {

// How fast two bodies can come nearer along the normal, and how much faster that can get: by
// fields, pushes, and as much friction, of both.
struct Nearing {
  double centres_m_s = 0.0;   // but for their rotation
  double turning_m_s = 0.0;   // of the points that rotation moves fastest, of both
  double turning_m_s2 = 0.0;  // they go in circles
  double pulled_m_s2 = 0.0;
};

Nearing nearing_of(const ContactImpactIsland& island, const ContactManifold& m,
                   std::span<const BodyState> states) {
  Nearing nearing{.pulled_m_s2 = 4.0 * island.strongest_field_m_s2()};
  for (const BodyId id : {m.a, m.b}) {
    if (is_static(id)) continue;
    const BodyState& state = island.state_of(id, states);
    const double speed = state.linear_velocity_m_s.dot(m.normal);
    nearing.centres_m_s += id == m.a ? speed : -speed;
    nearing.pulled_m_s2 += 2.0 * pushed_m_s2(island, id, state);
    const CompiledShape& shape = shape_of(island.scene, island.geometry, id);
    if (shape.kind == ShapeKind::kSphere) continue;
    const double angular_speed = state.angular_velocity_rad_s.norm();
    nearing.turning_m_s += angular_speed * shape.bounding_radius_m;
    nearing.turning_m_s2 += angular_speed * angular_speed * shape.bounding_radius_m;
  }
  return nearing;
}

double time_over_s(double gap_m, double speed_m_s, double faster_m_s2) {
  const double meeting = std::sqrt(speed_m_s * speed_m_s + 2.0 * faster_m_s2 * gap_m);
  return 2.0 * gap_m / (speed_m_s + meeting);
}

}  // namespace

double clear_s(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
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

namespace {

double across_rad_s(const Vec3& angular_velocity, const Vec3& axis) {
  return (angular_velocity - axis * axis.dot(angular_velocity)).norm();
}

// By which a body shows other features: a ball shows none, what is round shows none by turning
// about its axis, and a halfspace sees none of what turns about its normal.
double showing_angular_speed_rad_s(const ContactImpactIsland& island, const ContactManifold& m,
                                   BodyId id, const BodyState& state) {
  const ShapeKind kind = shape_of(island.scene, island.geometry, id).kind;
  const Vec3& angular_velocity = state.angular_velocity_rad_s;
  if (kind == ShapeKind::kSphere) return 0.0;
  double shows = angular_velocity.norm();
  if (kind == ShapeKind::kCapsule || kind == ShapeKind::kCylinder)
    shows = across_rad_s(angular_velocity, state.orientation.toRotationMatrix().col(2));
  if (is_static(m.b) && shape_of(island.scene, island.geometry, m.b).kind == ShapeKind::kHalfSpace)
    shows = std::min(shows, across_rad_s(angular_velocity, m.normal));
  return shows;
}

}  // namespace

double foreseen_s(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
                  std::span<const BodyState> states) {
  double foreseen = kNever;
  for (const ContactManifold& m : contacts) {
    if (is_joint(m) || island.slow_m_s(m) == kNever) continue;
    for (const BodyId id : {m.a, m.b}) {
      if (is_static(id)) continue;
      const double angular_speed =
          showing_angular_speed_rad_s(island, m, id, island.state_of(id, states));
      if (angular_speed > 0.0) foreseen = std::min(foreseen, kForeseenRotation_rad / angular_speed);
    }
  }
  return foreseen;
}

ContactManifold without_impacts(const ContactImpactIsland& island, const ContactManifold& contact,
                                std::span<const BodyState> states) {
  const double slow = island.slow_m_s(contact);
  ContactManifold m = contact;
  m.count = 0;
  for (std::uint32_t i = 0; i < contact.count; ++i)
    if (!(island.approach_m_s(contact, contact.points[i], states) > slow))
      m.points[m.count++] = contact.points[i];
  return m;
}

void append_held(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
                 std::span<BodyState> states, std::vector<ContactManifold>& held) {
  for (const ContactManifold& contact : contacts) {
    const ContactManifold m = without_impacts(island, contact, states);
    for (std::uint32_t i = 0, kept = 0; i < contact.count; ++i) {
      const std::uint32_t feature = contact.points[i].feature;
      if (kept < m.count && m.points[kept].feature == feature) {
        ++kept;
        continue;
      }
      std::erase_if(island.state_of(m.a, states).impulses, [&](const ContactImpulse& impulse) {
        return impulse.other == m.b && impulse.part == m.part && impulse.feature == feature;
      });
    }
    if (m.count > 0) held.push_back(m);
  }
}

bool append_touching(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
                     std::span<const BodyState> states, std::vector<ContactManifold>& touching) {
  const std::size_t before = touching.size();
  for (const ContactManifold& contact : contacts) {
    ContactManifold m = contact;
    const double width = island.width_m(m), together = kTogether * width;
    // Who is hit is held by statics that it is just above; bodies that are apart are hit one by
    // one.
    if (!is_static(m.b) && least_separation_m(m) > kTouching * width) continue;
    const double slow = island.slow_m_s(m);
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
  return touching.size() > before;
}

}  // namespace soda::physics
