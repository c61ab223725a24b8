#include "physics/forces/forces.hpp"

#include <algorithm>
#include <vector>

#include "physics/forces/drive.hpp"
#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

BodyForces forces_of(const SceneDescription& scene, BodyId id) {
  const std::uint32_t forces = scene.bodies[index_of(id)].forces;
  return forces == kNone ? BodyForces{} : scene.forces[forces];
}

// Everything that damping does not do.
Vec3 acceleration_of(const SceneDescription& scene, double time_s, double ahead_s, BodyId id,
                     const BodyState& state) {
  const BodyParams& body = scene.bodies[index_of(id)];
  Vec3 acceleration = external_acceleration(scene, time_s, id, state);
  if (body.forces != kNone)
    acceleration +=
        own_force_newton(scene.forces[body.forces], ahead_s, state) * (1.0 / body.mass_kg);
  return acceleration;
}

// The angular momentum L' = torque - c L is known at any time. The attitude turns as it would with
// the mean of L over the step: under damping alone that is the free rotation, seen later.
void rotate_pushed(const BodyParams& body, const BodyForces& forces, double time_s,
                   BodyState& state) {
  const Decay decay = decay_over(forces.angular_damping_1_s, time_s);
  const auto times_inertia = [&state](const Mat3& local, const Vec3& v) {
    return Vec3(state.orientation * Vec3(local * (state.orientation.conjugate() * v)));
  };
  const Vec3 momentum = times_inertia(body.inertia_local_kg_m2, state.angular_velocity_rad_s);
  const Vec3 mean =
      (momentum * decay.speed_s + forces.torque_newton_m * decay.displacement_s2) / time_s;
  const Vec3 end = momentum * decay.left + forces.torque_newton_m * decay.speed_s;
  state.angular_velocity_rad_s = times_inertia(body.inverse_inertia_local, mean);
  rotate_freely(body, time_s, state);
  state.angular_velocity_rad_s = times_inertia(body.inverse_inertia_local, end);
}

}  // namespace

Decay decay_over(double rate_1_s, double time_s) {
  if (rate_1_s == 0.0) return {1.0, time_s, 0.5 * time_s * time_s};
  // With x = c t: left = 1 - x p1, p1 = 1 - x p2. A series for p2 of a halved x, doubled back by
  // sums of positive terms only.
  constexpr double kShort = 0.5;
  constexpr int kTerms = 18;
  double x = rate_1_s * time_s;
  int doublings = 0;
  for (; x > kShort; ++doublings) x *= 0.5;
  double p2 = 1.0;
  for (int k = kTerms; k >= 3; --k) p2 = 1.0 - x / k * p2;
  p2 *= 0.5;
  double p1 = 1.0 - x * p2, left = 1.0 - x * p1;
  for (int i = 0; i < doublings; ++i) {
    p2 = 0.5 * (p2 + 0.5 * p1 * p1);
    p1 = 0.5 * p1 * (1.0 + left);
    left *= left;
  }
  return {left, time_s * p1, time_s * time_s * p2};
}

Vec3 own_force_newton(const BodyForces& forces, double ahead_s, const BodyState& state) {
  if (forces.body_force_newton == Vec3::Zero()) return Vec3::Zero();
  const Quat then = turned(state.angular_velocity_rad_s * ahead_s, state.orientation);
  return then * forces.body_force_newton;
}

void push_body(const SceneDescription& scene, double time_s, double ahead_s, BodyId id,
               const BodyState& state, SolverBody& body) {
  const BodyForces forces = forces_of(scene, id);
  const Decay linear = decay_over(forces.linear_damping_1_s, time_s);
  body.linear = body.linear * linear.left +
                acceleration_of(scene, time_s, ahead_s, id, state) * linear.speed_s;
  const Decay angular = decay_over(forces.angular_damping_1_s, time_s);
  body.angular = body.angular * angular.left;
  body.angular += body.inverse_inertia * forces.torque_newton_m * angular.speed_s;
}

void SeenAhead::push(const SceneDescription& scene, double time_s, BodyId id) {
  const BodyParams& params = scene.bodies[index_of(id)];
  const Vec3 faster = acceleration_of(scene, time_s, 0.5 * time_s, id, *state_) * time_s;
  const SolverBody body = solver_body(params, *state_);
  pushed_ = *state_;
  pushed_->linear_velocity_m_s = body.linear + faster - field_of(scene, params) * time_s;
  pushed_->angular_velocity_rad_s =
      body.angular + body.inverse_inertia * forces_of(scene, id).torque_newton_m * time_s;
}

double most_push_m_s2(const SceneDescription& scene, const BodyParams& body) {
  double most = body.drive == kNoDrive ? 0.0 : scene.drives[body.drive].max_acceleration_m_s2;
  if (body.forces != kNone)
    most += scene.forces[body.forces].body_force_newton.norm() / body.mass_kg;
  return most;
}

double most_twist_rad_s2(const SceneDescription& scene, const BodyParams& body) {
  if (body.forces == kNone) return 0.0;
  return body.inverse_inertia_local.norm() * scene.forces[body.forces].torque_newton_m.norm();
}

Vec3 flight_lag_m(const SceneDescription& scene, double time_s, BodyId id, const BodyState& state) {
  const BodyParams& body = scene.bodies[index_of(id)];
  if (body.kinematic) return Vec3::Zero();
  if (!is_pushed(body)) return field_of(scene, body) * (0.5 * time_s * time_s);
  const Decay decay = decay_over(forces_of(scene, id).linear_damping_1_s, time_s);
  return acceleration_of(scene, time_s, 0.5 * time_s, id, state) *
             (decay.speed_s * time_s - decay.displacement_s2) +
         state.linear_velocity_m_s * (decay.left * time_s - decay.speed_s);
}

void fly(const SceneDescription& scene, double time_s, BodyId id, BodyState& state) {
  const BodyParams& body = scene.bodies[index_of(id)];
  const BodyForces forces = forces_of(scene, id);
  const Vec3 acceleration = acceleration_of(scene, time_s, 0.5 * time_s, id, state);
  if (forces.torque_newton_m == Vec3::Zero() && forces.angular_damping_1_s == 0.0)
    rotate_freely(body, time_s, state);
  else
    rotate_pushed(body, forces, time_s, state);
  const Decay decay = decay_over(forces.linear_damping_1_s, time_s);
  const Vec3 velocity = state.linear_velocity_m_s;
  state.position_m =
      state.position_m + velocity * decay.speed_s + acceleration * decay.displacement_s2;
  state.linear_velocity_m_s = velocity * decay.left + acceleration * decay.speed_s;
}

Vec3 push_impulse_newton_s(const SceneDescription& scene, double time_s, BodyId id,
                           const BodyState& state) {
  const Decay decay = decay_over(forces_of(scene, id).linear_damping_1_s, time_s);
  const Vec3 field = field_of(scene, scene.bodies[index_of(id)]);
  const Vec3 change =
      (acceleration_of(scene, time_s, 0.5 * time_s, id, state) - field) * decay.speed_s +
      field * (decay.speed_s - time_s) + state.linear_velocity_m_s * (decay.left - 1.0);
  return change * scene.bodies[index_of(id)].mass_kg;
}

Need drives_needed(const SceneDescription& scene) {
  const auto is_driven = [](const BodyParams& body) { return body.drive != kNoDrive; };
  return need_of(bodies_that(scene, is_driven) > 0, "a body has a drive", "no body has a drive");
}

Need forces_needed(const SceneDescription& scene) {
  return need_of(bodies_that(scene, is_forced) > 0, "a body has a force, a torque or damping",
                 "no body has forces or damping of its own");
}

bool are_all_springs(const SceneDescription& scene, std::span<const BodyId> ids,
                     std::span<const ContactManifold> manifolds,
                     std::span<const BodyState> states) {
  std::size_t ends = 0, wanted = 0;
  for (const ContactManifold& m : manifolds) {
    if (!is_joint(m)) continue;
    if (scene.joints[joint_of(m)].kind != JointKind::kSpring) return false;
    ends += is_static(m.b) ? 1 : 2;
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    wanted += scene.bodies[index_of(ids[i])].joints - states[i].broken_joints.size();
  return ends == wanted;
}

std::size_t loose_bodies(const SceneDescription& scene) {
  std::vector<bool> held;
  held.reserve(scene.bodies.size());
  for (const BodyParams& body : scene.bodies) held.push_back(is_pushed(body));
  for (const Joint& joint : scene.joints) {
    if (joint.kind == JointKind::kSpring || can_break(joint)) continue;
    held[index_of(joint.a)] = true;
    if (!is_static(joint.b)) held[index_of(joint.b)] = true;
  }
  return static_cast<std::size_t>(std::ranges::count(held, false));
}

Vec3 push_impulses_newton_s(const SceneDescription& scene, double time_s,
                            std::span<const BodyId> ids, std::span<const BodyState> states) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < states.size(); ++i)
    if (is_pushed(scene.bodies[index_of(ids[i])]))
      sum += push_impulse_newton_s(scene, time_s, ids[i], states[i]);
  return sum;
}

}  // namespace soda::physics
