// Motion of one rigid body over a step, given its velocities.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// For inner loops: Eigen's product is a call of its own.
inline Vec3 times(const Mat3& m, const Vec3& v) {
  return {m(0, 0) * v.x() + m(0, 1) * v.y() + m(0, 2) * v.z(),
          m(1, 0) * v.x() + m(1, 1) * v.y() + m(1, 2) * v.z(),
          m(2, 0) * v.x() + m(2, 1) * v.y() + m(2, 2) * v.z()};
}

// Rotation by a rotation vector (rad), without libm: a Taylor polynomial of the halved vector,
// squared back. Unit to rounding. Angles up to 1e9 rad.
Quat rotation_by(const Vec3& angle_rad);

// The orientation after a further rotation in the world frame; unchanged bits if it is zero.
Quat turned(const Vec3& angle_rad, const Quat& orientation);

// The shortest turn from one direction to another, of any lengths but zero. Of opposite ones, half
// a turn about an axis across. Eigen's FromTwoVectors has these bits for others, and for opposite
// ones a decomposition that takes six seconds to compile.
Quat turn_between(const Vec3& from, const Vec3& to);

// R I R^T, symmetric to the bit.
Mat3 rotated_tensor(const Mat3& rotation, const Mat3& tensor_local);

// By cofactors; for symmetric positive definite matrices.
Mat3 inverse_of_symmetric(const Mat3& m);

// Whether all directions are principal with one moment: then the angular velocity is constant.
bool is_isotropic(const Mat3& inertia_local);
// The axis about which a body is symmetric: the moments about the other two are equal and no
// products of inertia are left. -1 if there is none.
int symmetry_axis(const Mat3& inertia_local);

// Turns the body for dt_s (of any sign) without torque; world angular momentum and energy are kept
// to rounding. Exact to rounding for any dt_s: a constant angular velocity for an isotropic body, a
// steady precession for a symmetric one (one of its own axes, moments equal to the bit), else a
// Taylor series, in stretches of at most half a radian. A body of three moments turns by 512 rad at
// most: a faster one keeps its motion, but is late.
void rotate_freely(const BodyParams& params, double dt_s, BodyState& state);

// By how much an orientation is turned against another, as a rotation vector, rad; of larger angles
// twice the sine of the half.
inline Vec3 small_rotation(const Quat& from, const Quat& to) {
  const Quat difference = to * from.conjugate();
  const double sign = difference.w() < 0.0 ? -2.0 : 2.0;
  return sign * difference.vec();
}

// Turns the body in the world frame by a displacement that is no motion: its angular velocity turns
// with it, or a body of unequal moments would gain or lose energy.
void rotate_by(const BodyParams& params, const Vec3& angle_rad, BodyState& state);

// An impulse (world frame) at a point of the body, given from its centre of mass in its own frame:
// both velocities change.
void push(const BodyParams& params, const Vec3& impulse_newton_s, const Vec3& point_local_m,
          BodyState& state);

// Of the body's point that is at `point` (world frame), m/s.
inline Vec3 velocity_at(const BodyState& state, const Vec3& point) {
  return state.linear_velocity_m_s + state.angular_velocity_rad_s.cross(point - state.position_m);
}

// Energies in the state path; measures.hpp has those of reports.
double rotational_energy_joule(const BodyParams& params, const BodyState& state);
double kinetic_joule(const SceneDescription& scene, std::span<const BodyId> ids,
                     std::span<const BodyState> states);
// What kinetic energy and that in the bodies' fields rise by together.
double gain_joule(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<const BodyState> from, std::span<const BodyState> to);

// Whether a new state can be committed. The bounds keep every later computation finite.
inline constexpr double kLargestPosition_m = 1e12;
inline constexpr double kLargestSpeed_m_s = 1e9;
inline constexpr double kLargestAngularSpeed_rad_s = 1e9;
// Empty if it can; else what is wrong with it.
const char* fault_of(const BodyState& state);

// A body without drive and contact, after a time t_s >= 0 of which it knows its field alone. Exact
// to rounding for any t_s (see rotate_freely). Its impulses are left out.
BodyState flown(const SceneDescription& scene, BodyId id, const BodyState& state, double t_s);

}  // namespace soda::physics
