// Energy bounds speeds whatever happens within the step: bodies may pass their motion on, so that
// one that is slow before and after was fast in between. With forces per mass of at most a, the
// root of the kinetic energy K of a mass M grows by no more than a sqrt(M/2) a second, for dK/dt <=
// a sum(m v) <= a sqrt(2 M K).
#include "physics/constraints/displacement_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "physics/constraints/joint_rows.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {
namespace {

double elastic_of(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<const ContactManifold> manifolds, std::span<const BodyState> states) {
  if (std::ranges::none_of(manifolds, is_joint)) return 0.0;
  const JointSystem joints = find_joints(scene, ids, manifolds);
  return has_springs(scene, joints) ? elastic_joule(spring_rows(scene, states, joints)) : 0.0;
}

// By which what acts on the body besides contacts and joints can change its speed.
double most_acceleration_m_s2(const SceneDescription& scene, const BodyParams& body,
                              const BodyState& state) {
  double most = field_of(scene, body).norm() + most_push_m_s2(scene, body);
  if (body.forces == kNone) return most;
  const BodyForces& own = scene.forces[body.forces];
  const double torque = own.torque_newton_m.norm();
  most += std::sqrt(body.inverse_inertia_local.norm() / body.mass_kg) * torque;
  return most + own.linear_damping_1_s * state.linear_velocity_m_s.norm();
}

double fastest_surface_m_s(const SceneDescription& scene,
                           std::span<const ContactManifold> manifolds) {
  double fastest = 0.0;
  for (const ContactManifold& m : manifolds)
    if (is_static(m.b) && !is_joint(m))
      fastest = std::max(fastest, scene.statics[static_index_of(m.b)].surface_velocity_m_s.norm());
  return fastest;
}

std::string impossible_displacement(double displacement_m, double most_m) {
  char text[160];
  std::snprintf(
      text, sizeof text,
      "moves %.6g m in one step; the energy of its island and position correction allow %.6g m",
      displacement_m, most_m);
  return text;
}

}  // namespace

FastestCorrection fastest_correction(const SceneDescription& scene, std::span<const BodyId> ids) {
  double widest_m = 0.0;
  for (const BodyId id : ids)
    if (!is_kinematic(scene, id))
      widest_m = std::max(widest_m, size_of(scene, scene.bodies[index_of(id)].shape));
  return {scene.solver.push_out_1_s * widest_m, 2.0 * scene.solver.push_out_1_s};
}

double weight_newton(const SceneDescription& scene, std::span<const BodyId> ids) {
  double mass_kg = 0.0, own_newton = 0.0;
  for (const BodyId id : ids) {
    const BodyParams& body = scene.bodies[index_of(id)];
    if (body.kinematic) continue;
    mass_kg += body.mass_kg;
    own_newton += body.mass_kg * body.own_field_m_s2.norm();
  }
  return mass_kg * scene.gravity_m_s2.norm() + own_newton;
}

void limit_correction(const FastestCorrection& most, PositionCorrection& correction) {
  const auto shorten = [](double longest, Vec3& v) {
    const double squared = v.squaredNorm();
    if (squared > longest * longest) v *= longest / std::sqrt(squared);
  };
  shorten(most.m_s, correction.linear);
  shorten(most.rad_s, correction.angular);
}

void limit_correction(const FastestCorrection& most, std::span<PositionCorrection> correction) {
  double share = 1.0;
  for (const PositionCorrection& p : correction) {
    const double linear = p.linear.norm(), angular = p.angular.norm();
    if (linear * share > most.m_s) share = most.m_s / linear;
    if (angular * share > most.rad_s) share = most.rad_s / angular;
  }
  if (share == 1.0) return;
  for (PositionCorrection& p : correction) {
    p.linear *= share;
    p.angular *= share;
  }
}

namespace {

// Joints but springs are closed by any displacement of this: nothing bounds it.
bool closes_joints(const SceneDescription& scene, std::span<const ContactManifold> manifolds) {
  return std::ranges::any_of(manifolds, [&scene](const ContactManifold& m) {
    return is_joint(m) && scene.joints[joint_of(m)].kind != JointKind::kSpring;
  });
}

}  // namespace

void bound_displacements(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                         std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states, DisplacementBounds& bounds) {
  bounds.positions_m.clear();
  bounds.any = !closes_joints(scene, manifolds) && !any_carries(scene, ids, states);
  if (!bounds.any) return;
  bounds.dt_s = dt_s;
  double mass_kg = 0.0, faster_m_s = 0.0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& body = scene.bodies[index_of(ids[i])];
    bounds.positions_m.push_back(states[i].position_m);
    if (body.kinematic) continue;
    mass_kg += body.mass_kg;
    faster_m_s = std::max(faster_m_s, dt_s * most_acceleration_m_s2(scene, body, states[i]));
  }
  const double surface_m_s = fastest_surface_m_s(scene, manifolds);
  bounds.driven = surface_m_s > 0.0;
  faster_m_s += surface_m_s;
  const double energy_joule =
      kinetic_joule(scene, ids, states) + elastic_of(scene, ids, manifolds, states);
  bounds.root = std::sqrt(energy_joule) + faster_m_s * std::sqrt(0.5 * mass_kg);
  bounds.pushed_m_s = fastest_correction(scene, ids).m_s;
}

bool is_overdriven(const SceneDescription& scene, std::span<const BodyId> ids,
                   std::span<const BodyState> states, const DisplacementBounds& bounds) {
  return bounds.any && bounds.driven &&
         kinetic_joule(scene, ids, states) > bounds.root * bounds.root;
}

double share_within(const SceneDescription& scene, const DisplacementBounds& bounds,
                    std::span<const BodyId> ids, std::span<const SolverBody> bodies) {
  double share = 1.0;
  for (std::size_t i = 0; i < ids.size() && bounds.any; ++i) {
    if (is_kinematic(scene, ids[i])) continue;
    const double speed = bodies[i].linear.norm();
    const double most = bounds.root * std::sqrt(2.0 / scene.bodies[index_of(ids[i])].mass_kg);
    if (speed * share > most) share = most / speed;
  }
  return share;
}

void report_impossible_displacement(const SceneDescription& scene, const DisplacementBounds& bounds,
                                    std::size_t i, BodyId id, const BodyState& state,
                                    std::vector<AdvanceFault>& faults) {
  constexpr double kRounding = 1e-12;  // of where it is, and of its displacement
  if (!bounds.any || is_kinematic(scene, id)) return;
  const double fastest_m_s = bounds.root * std::sqrt(2.0 / scene.bodies[index_of(id)].mass_kg);
  const double allowed_m = bounds.dt_s * (fastest_m_s + bounds.pushed_m_s);
  const double most_m = allowed_m + kRounding * (allowed_m + bounds.positions_m[i].norm());
  const double displacement_m = (state.position_m - bounds.positions_m[i]).norm();
  if (displacement_m > most_m)
    faults.push_back({id, impossible_displacement(displacement_m, most_m)});
}

}  // namespace soda::physics
