#include "physics/advance.hpp"

#include <algorithm>
#include <cmath>

#include "physics/contact_choice.hpp"
#include "physics/drive.hpp"
#include "physics/joint_motion.hpp"
#include "physics/rigid_motion.hpp"

namespace soda::physics {
namespace {

bool accept(BodyId id, const BodyState& next, std::vector<AdvanceFault>& faults) {
  const char* fault = fault_of(next);
  if (*fault) faults.push_back({id, fault});
  return !*fault;
}

// Detection only: contacts are reported, bodies move as if they touched nothing.
void pass_through(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                  IslandReport& report, StageCounters& counters,
                  std::vector<AdvanceFault>& faults) {
  for (const ContactManifold& m : manifolds) {
    for (std::uint32_t i = 0; i < m.count; ++i) {
      report.max_penetration_m = std::max(report.max_penetration_m, -m.points[i].separation_m);
    }
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    advance_free_body(scene, ids[i], states[i], counters, faults);
  }
}

// Velocities after external forces, and the inertia that contacts meet.
void load_bodies(const SceneDescription& scene, std::span<const BodyId> ids,
                 std::span<const BodyState> states, std::vector<SolverBody>& bodies,
                 StageCounters& counters) {
  bodies.resize(ids.size() + 1);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    bodies[i] = solver_body(params, states[i]);
    bodies[i].linear += external_acceleration(scene, ids[i], states[i]) * scene.dt_s;
    counters.driven_bodies += params.drive != kNoDrive;
  }
}

Vec3 impulse_on_b(const ContactProblem& problem, std::size_t row) {
  const NormalRow& normal = problem.normals[row];
  Vec3 impulse = normal.normal * normal.impulse_newton_s;
  if (problem.contacts[row].friction_row >= 0) {
    const FrictionRow& f = problem.frictions[problem.contacts[row].friction_row];
    impulse += f.tangent[0] * f.impulse_newton_s[0] + f.tangent[1] * f.impulse_newton_s[1];
  }
  return impulse;
}

// A body that nothing but bounces acted on flies along parabolas: its velocity changed at the
// impacts, not at the step's start. Any other body moves by its final velocity (semi-implicit).
struct Flight {
  bool supported = false;
  Vec3 not_yet_m = Vec3::Zero();  // displacement that impulses would have made before their impact
};

std::vector<Flight> find_flights(const ContactProblem& problem) {
  std::vector<Flight> flights(problem.bodies.size());
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const NormalRow& row = problem.normals[i];
    if (row.impulse_newton_s == 0.0) continue;
    Flight& a = flights[row.a];
    Flight& b = flights[row.b];
    if (!problem.contacts[i].bounces) {
      a.supported = b.supported = true;
      continue;
    }
    const Vec3 delayed = impulse_on_b(problem, i) * problem.contacts[i].impact_time_s;
    a.not_yet_m -= delayed * problem.bodies[row.a].inverse_mass;
    b.not_yet_m += delayed * problem.bodies[row.b].inverse_mass;
  }
  return flights;
}

// The rows of which body `a` is the lower one follow each other; `row` is the first that may be.
void store_impulses(std::span<const ContactManifold> manifolds, const ContactProblem& problem,
                    std::size_t a, std::size_t& row, std::vector<ContactImpulse>& stored) {
  stored.clear();
  for (; row < problem.normals.size() && problem.normals[row].a == a; ++row) {
    const NormalRow& normal = problem.normals[row];
    if (normal.impulse_newton_s == 0.0) continue;
    const RowContact& contact = problem.contacts[row];
    const ContactManifold& m = manifolds[contact.manifold];
    const Vec3 along = normal.normal * normal.impulse_newton_s;
    stored.push_back({m.b, m.part, m.points[contact.point].feature, normal.impulse_newton_s,
                      impulse_on_b(problem, row) - along});
  }
}

BodyState moved(const SceneDescription& scene, BodyId id, const SolverBody& body,
                const Flight& flight, const PushOut* push, const BodyState& state) {
  const double dt = scene.dt_s;
  BodyState next;
  next.position_m = state.position_m + body.linear * dt;
  if (!flight.supported) {
    const Vec3 acceleration = external_acceleration(scene, id, state);
    next.position_m -= acceleration * (0.5 * dt * dt) + flight.not_yet_m;
  }
  next.linear_velocity_m_s = body.linear;
  next.angular_velocity_rad_s = body.angular;
  next.orientation = state.orientation;
  rotate_freely(scene.bodies[index_of(id)], dt, next);
  if (push != nullptr) {
    next.position_m += push->linear * dt;
    next.orientation = turned(push->angular * dt, next.orientation);
  }
  return next;
}

void move_bodies(const SceneDescription& scene, std::span<const BodyId> ids,
                 std::span<const ContactManifold> manifolds, const ContactProblem& problem,
                 const std::vector<PushOut>& push, const JointSystem& joints,
                 std::span<BodyState> states, std::vector<AdvanceFault>& faults) {
  std::vector<Flight> flights = find_flights(problem);
  for (const JointRow& row : joints.rows)
    flights[row.a].supported = flights[row.b].supported = true;
  std::size_t row = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    BodyState next = moved(scene, ids[i], problem.bodies[i], flights[i],
                           push.empty() ? nullptr : &push[i], states[i]);
    const bool accepted = accept(ids[i], next, faults);
    std::vector<ContactImpulse> stored = std::move(states[i].impulses);
    if (accepted) {
      store_impulses(manifolds, problem, i, row, stored);
      states[i] = std::move(next);
    } else {
      while (row < problem.normals.size() && problem.normals[row].a == i) ++row;
    }
    states[i].impulses = std::move(stored);
  }
}

void report_contacts(std::span<const BodyState> states, const ContactProblem& problem,
                     IslandReport& report) {
  const std::uint32_t statics = static_cast<std::uint32_t>(states.size());
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const RowContact& contact = problem.contacts[i];
    report.max_penetration_m = std::max(report.max_penetration_m, -contact.separation_m);
    const NormalRow& row = problem.normals[i];
    if (row.b != statics) continue;
    // Friction counts even where the normal impulse ended at zero: after the last sweep it may not
    // have been taken back to its disc yet (a constraint residual, but an impulse all the same).
    const Vec3 impulse = -impulse_on_b(problem, i);
    if (impulse == Vec3::Zero()) continue;
    report.static_impulse_newton_s += impulse;
    report.static_angular_impulse_newton_m_s +=
        (states[row.a].position_m + contact.arm_a).cross(impulse);
  }
}

// With joints, their direct solution and sweeps over the contacts take turns.
ContactSolution solve_jointed(const SceneDescription& scene, std::span<const BodyId> ids,
                              std::span<const BodyState> states, JointSystem& joints,
                              ContactProblem& problem) {
  ContactSolution solution;
  solution.iterations =
      static_cast<std::uint32_t>(solve_with_joints(scene, ids, states, joints, problem));
  if (problem.restitution_rows > 0 && aim_rebounds(problem)) {
    take_back_joint_impulses(joints, problem.bodies);
    solution.iterations +=
        static_cast<std::uint32_t>(solve_with_joints(scene, ids, states, joints, problem));
  }
  solve_push_out(scene.solver.iterations, scene.dt_s, problem, solution.push);
  return solution;
}

}  // namespace

SolverBody solver_body(const BodyParams& params, const BodyState& state) {
  return {.linear = state.linear_velocity_m_s,
          .angular = state.angular_velocity_rad_s,
          .inverse_mass = 1.0 / params.mass_kg,
          .inverse_inertia = is_isotropic(params.inertia_local_kg_m2)
                                 ? params.inverse_inertia_local
                                 : rotated_tensor(state.orientation.toRotationMatrix(),
                                                  params.inverse_inertia_local)};
}

IslandReport advance_island(const SceneDescription& scene, std::span<const BodyId> ids,
                            std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                            StageCounters& counters, std::vector<AdvanceFault>& faults) {
  IslandReport report;
  report.label = ids.front();
  report.bodies = static_cast<std::uint32_t>(ids.size());
  for (const ContactManifold& m : manifolds) report.contact_points += m.count;
  if (!scene.solver.contact_response) {
    pass_through(scene, ids, manifolds, states, report, counters, faults);
    return report;
  }
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (!scene.joints.empty()) report_lost_joints(scene, ids, manifolds, faults);
  const bool linked = !joints.empty() && report.contact_points == 0 &&
                      !has_springs(scene, joints) &&
                      advance_linkage(scene, ids, joints, states, report, faults);
  if (linked) {
    ++counters.islands_solved;
    counters.solver_iterations += report.iterations;
    counters.joint_rows += joints.rows.size();
    return report;
  }
  ContactProblem problem;
  load_bodies(scene, ids, states, problem.bodies, counters);
  const std::vector<SolverBody> free(problem.bodies.begin(), problem.bodies.end() - 1);
  build_rows(scene, ids, manifolds, states, problem, counters);
  const ContactSolution solution = joints.empty()
                                       ? solve_contacts(scene, states, free, problem)
                                       : solve_jointed(scene, ids, states, joints, problem);
  report.direct = solution.direct;
  report.iterations = solution.iterations;
  report.multiplications = solution.multiplications;
  counters.joint_rows += joints.rows.size();
  report.constraint_residual_m_s = residual_m_s(problem);
  report_contacts(states, problem, report);
  report_joints(states, joints, report);
  move_bodies(scene, ids, manifolds, problem, solution.push, joints, states, faults);
  if (!joints.empty()) close_joints(scene, ids, joints, states);
  ++counters.islands_solved;
  counters.direct_islands += solution.direct;
  counters.solver_iterations += solution.iterations;
  counters.factor_multiplications += solution.multiplications;
  return report;
}

void advance_free_body(const SceneDescription& scene, BodyId id, BodyState& state,
                       StageCounters& counters, std::vector<AdvanceFault>& faults) {
  ++counters.free_bodies_advanced;
  if (scene.bodies[index_of(id)].joints > 0) report_lost_joints(scene, {&id, 1}, {}, faults);
  const double dt = scene.dt_s;
  BodyState next;
  // By reference: most bodies have no drive, and this is the cheapest of all stages.
  const Vec3* acceleration = &scene.gravity_m_s2;
  Vec3 driven;
  if (scene.bodies[index_of(id)].drive != kNoDrive) {
    driven = external_acceleration(scene, id, state);
    acceleration = &driven;
    ++counters.driven_bodies;
  }
  // Exact for constant gravity.
  next.position_m =
      state.position_m + state.linear_velocity_m_s * dt + *acceleration * (0.5 * dt * dt);
  next.linear_velocity_m_s = state.linear_velocity_m_s + *acceleration * dt;
  next.orientation = state.orientation;
  next.angular_velocity_rad_s = state.angular_velocity_rad_s;
  rotate_freely(scene.bodies[index_of(id)], dt, next);
  if (!accept(id, next, faults)) return;
  next.impulses = std::move(state.impulses);
  next.impulses.clear();
  state = std::move(next);
}

}  // namespace soda::physics
