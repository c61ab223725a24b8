#include "physics/math/rigid_motion.hpp"

#include <cmath>

#include "physics/math/carried.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {

Mat3 rotated_tensor(const Mat3& rotation, const Mat3& tensor_local) {
  const Mat3 half = rotation * tensor_local;
  Mat3 out;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      out(i, j) = half.row(i).dot(rotation.row(j));
      out(j, i) = out(i, j);
    }
  }
  return out;
}

Mat3 inverse_of_symmetric(const Mat3& m) {
  const double c00 = m(1, 1) * m(2, 2) - m(1, 2) * m(1, 2);
  const double c01 = m(0, 2) * m(1, 2) - m(0, 1) * m(2, 2);
  const double c02 = m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1);
  const double inverse = 1.0 / (m(0, 0) * c00 + m(0, 1) * c01 + m(0, 2) * c02);
  Mat3 out;
  out(0, 0) = c00 * inverse;
  out(0, 1) = out(1, 0) = c01 * inverse;
  out(0, 2) = out(2, 0) = c02 * inverse;
  out(1, 1) = (m(0, 0) * m(2, 2) - m(0, 2) * m(0, 2)) * inverse;
  out(1, 2) = out(2, 1) = (m(0, 1) * m(0, 2) - m(0, 0) * m(1, 2)) * inverse;
  out(2, 2) = (m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1)) * inverse;
  return out;
}

void rotate_by(const BodyParams& params, const Vec3& angle_rad, BodyState& state) {
  if (angle_rad == Vec3::Zero()) return;
  state.orientation = turned(angle_rad, state.orientation);
  if (is_isotropic(params.inertia_local_kg_m2)) return;
  state.angular_velocity_rad_s = rotation_by(angle_rad) * state.angular_velocity_rad_s;
}

void push(const BodyParams& params, const Vec3& impulse_newton_s, const Vec3& point_local_m,
          BodyState& state) {
  if (params.kinematic) return;
  const Mat3 rotation = state.orientation.toRotationMatrix();
  const Mat3 inverse_inertia = rotated_tensor(rotation, params.inverse_inertia_local);
  const Vec3 arm(rotation * point_local_m);
  const Vec3 twist = arm.cross(impulse_newton_s);
  for (int axis = 0; axis < 3; ++axis) {
    state.linear_velocity_m_s[axis] += impulse_newton_s[axis] / params.mass_kg;
    state.angular_velocity_rad_s[axis] += inverse_inertia.row(axis).dot(twist);
  }
}

double rotational_energy_joule(const BodyParams& params, const BodyState& state) {
  const Vec3 angular_velocity = state.orientation.conjugate() * state.angular_velocity_rad_s;
  return 0.5 * angular_velocity.dot(params.inertia_local_kg_m2 * angular_velocity);
}

double kinetic_joule(const SceneDescription& scene, std::span<const BodyId> ids,
                     std::span<const BodyState> states) {
  double sum = 0.0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    if (params.kinematic) continue;
    sum += 0.5 * params.mass_kg * states[i].linear_velocity_m_s.squaredNorm() +
           rotational_energy_joule(params, states[i]);
  }
  return sum;
}

double gain_joule(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<const BodyState> from, std::span<const BodyState> to) {
  double gain = kinetic_joule(scene, ids, to) - kinetic_joule(scene, ids, from);
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (falls(scene, ids[i]))
      gain -= scene.bodies[index_of(ids[i])].mass_kg *
              field_of(scene, ids[i]).dot(to[i].position_m - from[i].position_m);
  return gain;
}

const char* fault_of(const BodyState& s) {
  // Negated comparisons, so that NaN is a fault.
  if (!(s.position_m.cwiseAbs().maxCoeff() <= kLargestPosition_m) || !s.position_m.allFinite()) {
    return "position not finite or beyond 1e12 m";
  }
  if (!(s.linear_velocity_m_s.squaredNorm() <= kLargestSpeed_m_s * kLargestSpeed_m_s)) {
    return "speed not finite or above 1e9 m/s";
  }
  if (!(s.angular_velocity_rad_s.squaredNorm() <=
        kLargestAngularSpeed_rad_s * kLargestAngularSpeed_rad_s)) {
    return "spin not finite or above 1e9 rad/s";
  }
  if (!(std::abs(s.orientation.squaredNorm() - 1.0) < 1e-6)) return "orientation not unit";
  return "";
}

BodyState carried(const SceneDescription& scene, BodyId id, const BodyState& state, double t_s) {
  BodyState next = motion_of(state);
  if (state.linear_velocity_m_s != Vec3::Zero()) next.position_m += state.linear_velocity_m_s * t_s;
  if (state.angular_velocity_rad_s != Vec3::Zero())
    rotate_freely(scene.bodies[index_of(id)], t_s, next);
  return next;
}

BodyState flown(const SceneDescription& scene, BodyId id, const BodyState& state, double t_s) {
  if (is_kinematic(scene, id)) return carried(scene, id, state, t_s);
  const BodyParams& params = scene.bodies[index_of(id)];
  const Vec3 field = field_of(scene, params);
  BodyState next;
  if (!state.broken_joints.empty()) next.broken_joints = state.broken_joints;
  next.position_m = state.position_m + state.linear_velocity_m_s * t_s + field * (0.5 * t_s * t_s);
  next.linear_velocity_m_s = state.linear_velocity_m_s + field * t_s;
  next.orientation = state.orientation;
  next.angular_velocity_rad_s = state.angular_velocity_rad_s;
  rotate_freely(params, t_s, next);
  return next;
}

}  // namespace soda::physics
