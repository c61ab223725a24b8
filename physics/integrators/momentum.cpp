// A displacement that is no motion (position correction of an overlap), and an impact put at
// another time than the end of the step, move mass past the velocity that it has: each changes L by
// mass times displacement times velocity, although every impulse acts on two bodies at one point.
// It is given back as v + dV + dw x r, w + dw to all bodies: of all velocity changes with this
// change of P and L the least in kinetic energy, and one that no contact or joint within the island
// feels.
#include "physics/integrators/momentum.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {
namespace {

Mat3 world_inertia(const BodyParams& params, const BodyState& state) {
  return is_isotropic(params.inertia_local_kg_m2)
             ? params.inertia_local_kg_m2
             : rotated_tensor(state.orientation.toRotationMatrix(), params.inertia_local_kg_m2);
}

struct RigidMotion {
  Vec3 velocity_m_s, angular_velocity_rad_s;
};

RigidMotion common_motion(const IslandMomentum& whole, const Vec3& linear, const Vec3& angular) {
  const Eigen::LLT<Mat3> inertia(whole.inertia_kg_m2);
  return {linear / whole.mass_kg, inertia.solve(angular)};
}

// v becomes motion + share (v - from), in the velocity fields of the whole; all are shifted.
void change_common_motion(const Vec3& centre_m, const Vec3& shift_m, const RigidMotion& from,
                          const RigidMotion& to, double share, std::span<BodyState> states) {
  for (BodyState& state : states) {
    const Vec3 arm = state.position_m - centre_m;
    state.position_m += shift_m;
    const auto field = [&arm](const RigidMotion& m) -> Vec3 {
      return m.velocity_m_s + m.angular_velocity_rad_s.cross(arm);
    };
    state.linear_velocity_m_s = field(to) + share * (state.linear_velocity_m_s - field(from));
    state.angular_velocity_rad_s =
        to.angular_velocity_rad_s +
        share * (state.angular_velocity_rad_s - from.angular_velocity_rad_s);
  }
}

}  // namespace

IslandMomentum momentum_of(const SceneDescription& scene, std::span<const BodyId> ids,
                           std::span<const BodyState> states) {
  IslandMomentum sum;
  const Vec3 near = states.front().position_m;  // far from the origin, small numbers
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (is_kinematic(scene, ids[i])) continue;
    const double mass = scene.bodies[index_of(ids[i])].mass_kg;
    sum.mass_kg += mass;
    sum.centre_m += mass * (states[i].position_m - near);
    sum.linear_newton_s += mass * states[i].linear_velocity_m_s;
  }
  sum.centre_m = near + sum.centre_m / sum.mass_kg;
  const Vec3 drift = sum.linear_newton_s / sum.mass_kg;
  sum.field_m_s2 = field_of(scene, ids.front());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    if (params.kinematic) continue;
    const Mat3 inertia = world_inertia(params, states[i]);
    const Vec3 arm = states[i].position_m - sum.centre_m;
    const Vec3 velocity = states[i].linear_velocity_m_s - drift;
    sum.angular_newton_m_s +=
        times(inertia, states[i].angular_velocity_rad_s) + params.mass_kg * arm.cross(velocity);
    sum.inertia_kg_m2 += inertia + params.mass_kg * (arm.squaredNorm() * Mat3::Identity() -
                                                     Mat3(arm * arm.transpose()));
    const Vec3 other_newton = params.mass_kg * (field_of(scene, params) - sum.field_m_s2);
    sum.other_newton += other_newton;
    sum.other_newton_m += arm.cross(other_newton);
    sum.one_field = sum.one_field && other_newton == Vec3::Zero();
    sum.kinetic_joule +=
        rotational_energy_joule(params, states[i]) + 0.5 * params.mass_kg * velocity.squaredNorm();
  }
  return sum;
}

bool is_isolated_system(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds,
                        std::span<const BodyState> states) {
  if (ids.size() < 2) return false;
  for (const ContactManifold& m : manifolds)
    if (is_static(m.b) || m.b == kWorldBody) return false;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    if (is_pushed(params) || !is_unjointed(params, states[i])) return false;
  }
  return true;
}

void keep_momentum(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                   const IslandMomentum& before, std::span<BodyState> states) {
  const IslandMomentum now = momentum_of(scene, ids, states);
  const RigidMotion from = common_motion(now, now.linear_newton_s, now.angular_newton_m_s);
  const Vec3 field = now.field_m_s2 + now.other_newton / now.mass_kg;
  const Vec3 angular =
      before.angular_newton_m_s + 0.5 * dt_s * (before.other_newton_m + now.other_newton_m);
  RigidMotion to = common_motion(now, before.linear_newton_s + now.mass_kg * dt_s * field, angular);
  const double most =
      now.one_field ? std::min(now.kinetic_joule, before.kinetic_joule) : now.kinetic_joule;
  // The energy of the turning whole is given, the rest can shrink. Displaced towards their centre,
  // bodies that turn as one cannot keep L without a gain: then L shrinks as well.
  const double within =
      now.kinetic_joule - 0.5 * now.angular_newton_m_s.dot(from.angular_velocity_rad_s);
  const double turning = 0.5 * angular.dot(to.angular_velocity_rad_s);
  if (turning > most) to.angular_velocity_rad_s *= std::sqrt(most / turning);
  const double left = most - turning;
  const double share =
      left < within && within > 0.0 ? std::sqrt(std::max(left, 0.0) / within) : 1.0;
  const Vec3 flown = dt_s * (before.linear_newton_s / before.mass_kg) + 0.5 * dt_s * dt_s * field;
  change_common_motion(now.centre_m, flown - (now.centre_m - before.centre_m), from, to, share,
                       states);
}

}  // namespace soda::physics
