// The mutable state of a dynamic body: all that a checkpoint, a ghost or a migration carries.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::physics {

// Impulse of one contact point at the end of the last step, for warm starting. State, not a cache:
// it decides bits, so it is checkpointed and travels with its body.
struct ContactImpulse {
  BodyId other{};             // the pair's higher id (a dynamic or static body)
  std::uint32_t part = 0;     // see ContactManifold::part
  std::uint32_t feature = 0;  // see ContactPoint::feature
  double normal_newton_s = 0.0;
  Vec3 friction_newton_s = Vec3::Zero();  // world frame, on body b of the pair
};

struct BodyState {
  Vec3 position_m = Vec3::Zero();       // centre of mass
  Quat orientation = Quat::Identity();  // local to world, unit
  Vec3 linear_velocity_m_s = Vec3::Zero();
  Vec3 angular_velocity_rad_s = Vec3::Zero();
  // Contacts in which this body is the lower id, sorted by (other, part, feature).
  std::vector<ContactImpulse> impulses;
  // Labels of its joints that have broken, ascending; both bodies of such a joint have it.
  std::vector<std::uint32_t> broken_joints;
};

// Bitwise equality of every named field (so -0 != +0 and NaN == the same NaN).
bool identical(const BodyState& a, const BodyState& b);

// The first field of `a` that is not bitwise equal in `b`, as "name" with both values; empty name
// if none. For reporting divergence.
struct FieldDifference {
  const char* field = "";
  double a = 0.0, b = 0.0;
};
FieldDifference first_difference(const BodyState& a, const BodyState& b);

// As `state`, but for the impulses.
inline BodyState motion_of(const BodyState& state) {
  BodyState motion;
  motion.position_m = state.position_m;
  motion.orientation = state.orientation;
  motion.linear_velocity_m_s = state.linear_velocity_m_s;
  motion.angular_velocity_rad_s = state.angular_velocity_rad_s;
  motion.broken_joints = state.broken_joints;
  return motion;
}

}  // namespace soda::physics
