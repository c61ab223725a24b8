#include "physics/joint_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "physics/convex_contacts.hpp"
#include "physics/forces.hpp"
#include "physics/joint_bounds.hpp"
#include "physics/rigid_motion.hpp"

namespace soda::physics {
namespace {

constexpr int kMostCorrections = 20;
// Errors of rounding, of coordinates up to the largest.
double rounding_of(std::span<const BodyState> states) {
  double largest = 1.0;
  for (const BodyState& state : states)
    largest = std::max(largest, state.position_m.cwiseAbs().maxCoeff());
  return 1e-15 * largest;
}

std::vector<SolverBody> bodies_at(const SceneDescription& scene, std::span<const BodyId> ids,
                                  std::span<const BodyState> states) {
  std::vector<SolverBody> bodies(ids.size() + 1);
  for (std::size_t i = 0; i < ids.size(); ++i)
    bodies[i] = solver_body(scene.bodies[index_of(ids[i])], states[i]);
  return bodies;
}

void push(const SceneDescription& scene, std::span<const BodyId> ids,
          std::span<const BodyState> states, double dt_s, std::span<SolverBody> bodies) {
  for (std::size_t i = 0; i < ids.size(); ++i)
    apply_external(scene, dt_s, 0.0, ids[i], states[i], bodies[i]);
}

// From `states` on, with these velocities and no force.
std::vector<BodyState> drifted(const SceneDescription& scene, std::span<const BodyId> ids,
                               std::span<const BodyState> states,
                               std::span<const SolverBody> bodies, double dt_s) {
  std::vector<BodyState> next(states.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].position_m = states[i].position_m + bodies[i].linear * dt_s;
    next[i].orientation = states[i].orientation;
    next[i].linear_velocity_m_s = bodies[i].linear;
    next[i].angular_velocity_rad_s = bodies[i].angular;
    rotate_freely(scene.bodies[index_of(ids[i])], dt_s, next[i]);
  }
  return next;
}

// Stages of the composition of a symmetric method of second order that is of fourth order (Suzuki):
// parts of the step, the middle one backwards.
constexpr double kOuter = 0.41449077179437574;  // 1 / (4 - cbrt(4))
constexpr std::array kStages{kOuter, kOuter, 1.0 - 4.0 * kOuter, kOuter, kOuter};

// Whether time can run backwards for a while: nothing damps, stops or drives.
bool is_reversible(const SceneDescription& scene, std::span<const BodyId> ids,
                   const JointSystem& joints) {
  const auto keeps = [&scene](BodyId id) {
    const BodyParams& body = scene.bodies[index_of(id)];
    if (!is_pushed(body)) return true;
    if (body.drive != kNoDrive) return false;
    const BodyForces& forces = scene.forces[body.forces];
    return forces.linear_damping_1_s == 0.0 && forces.angular_damping_1_s == 0.0;
  };
  return !joints.bounded && std::ranges::all_of(ids, keeps);
}

// What drives, forces and damping gave in a linkage and push_impulse_newton_s did not foresee.
Vec3 unforeseen_newton_s(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                         std::span<const BodyState> before, std::span<const BodyState> after,
                         const Vec3& by_world_newton_s) {
  Vec3 rest = -by_world_newton_s;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const double mass = scene.bodies[index_of(ids[i])].mass_kg;
    rest += (after[i].linear_velocity_m_s - before[i].linear_velocity_m_s) * mass;
    rest -= scene.gravity_m_s2 * (mass * dt_s);
    if (is_pushed(scene.bodies[index_of(ids[i])]))
      rest -= push_impulse_newton_s(scene, dt_s, ids[i], before[i]);
  }
  return rest;
}

// A joint under tension is a stiff spring for what turns across it: of a body that is held at an
// arm r with a force f, the rate is sqrt(f r / (I + m r^2)). The explicit step is stable up to
// twice its inverse, and accurate well below.
int substeps_of(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                std::span<const BodyState> states, bool fourth, JointSystem& joints) {
  // Of a swing about a taut joint, and of a spin, which has farther to go.
  const double most_swing_rad = fourth ? 0.5 : 0.25, most_spin_rad = fourth ? 0.2 : 0.25;
  constexpr int kMost = 100;
  std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  push(scene, ids, states, dt_s, bodies);
  build_joint_rows(scene, dt_s, ids, states, false, joints);
  bound_velocities(dt_s, rounding_of(states), joints);
  stop_joint_velocities(ids.size(), bodies, joints);
  std::vector<double> squared(ids.size() + 1, 0.0);
  const auto stiffen = [&](std::uint32_t body, const JointRow& row, const Vec3& turn) {
    if (body >= ids.size() || row.linear == Vec3::Zero()) return;
    const double force = std::abs(row.impulse_newton_s) / dt_s, arm = turn.norm();
    const double mass = scene.bodies[index_of(ids[body])].mass_kg;
    squared[body] += force * arm / (1.0 / bodies[body].inverse_inertia.norm() + mass * arm * arm);
  };
  for (const JointRow& row : joints.rows) {
    stiffen(row.a, row, row.turn_a);
    stiffen(row.b, row, row.turn_b);
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < ids.size(); ++i)
    largest = std::max({largest, std::sqrt(squared[i]) / most_swing_rad,
                        states[i].angular_velocity_rad_s.norm() / most_spin_rad});
  const double parts = largest * dt_s;
  return parts < kMost ? 1 + static_cast<int>(parts) : kMost;
}

// Limits this many roundings away are reached.
constexpr double kReached = 1e3;

// Before places are corrected: no limit holds yet, motors have done what they could.
void start_corrections(std::size_t body_count, std::span<const SolverBody> bodies,
                       JointSystem& joints) {
  if (!joints.bounded) return;
  rest_bounds(joints);
  factor_joint_rows(body_count, bodies, joints);
}

// False if the joints do not hold at its end.
bool advance_linkage_once(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                          JointSystem& joints, std::vector<BodyState>& states,
                          IslandReport& report) {
  const double enough = rounding_of(states);
  std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  push(scene, ids, states, 0.5 * dt_s, bodies);
  build_joint_rows(scene, dt_s, ids, states, false, joints);
  bound_velocities(0.5 * dt_s, kReached * enough, joints);
  stop_joint_velocities(ids.size(), bodies, joints);
  std::vector<BodyState> next = drifted(scene, ids, states, bodies, dt_s);
  // Impulses act at the start of the step: along its rows, until the joints hold at its end.
  JointSystem end = joints;
  build_joint_rows(scene, dt_s, ids, next, false, end);
  start_corrections(ids.size(), bodies, joints);
  hold_same_limits(joints, end);
  double error = largest_error(end);
  for (int i = 0; i < kMostCorrections && error > enough; ++i) {
    const bool more = hold_passed_limits(enough, end);
    if (more) {
      hold_same_limits(end, joints);
      factor_joint_rows(ids.size(), bodies, joints);
    }
    for (std::size_t r = 0; r < joints.rows.size(); ++r)
      joints.rows[r].error = end.rows[r].error / dt_s;
    add_joint_impulses(joints, bodies);
    next = drifted(scene, ids, states, bodies, dt_s);
    build_joint_rows(scene, dt_s, ids, next, false, end);
    hold_same_limits(joints, end);
    const double before = std::exchange(error, largest_error(end));
    ++report.iterations;
    if (error > 2.0 * before && !more) return false;
  }
  if (error > 1e6 * enough) return false;
  report_joints(states, joints, report);
  bodies = bodies_at(scene, ids, next);
  push(scene, ids, states, 0.5 * dt_s, bodies);
  rest_bounds(end);
  bound_velocities(0.5 * dt_s, kReached * enough, end);
  stop_joint_velocities(ids.size(), bodies, end);
  report_joints(next, end, report);
  report.constraint_residual_m_s = std::max(report.constraint_residual_m_s, error / std::abs(dt_s));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].linear_velocity_m_s = bodies[i].linear;
    next[i].angular_velocity_rad_s = bodies[i].angular;
  }
  states = std::move(next);
  return true;
}

double moving_joule(const SceneDescription& scene, std::span<const BodyId> ids,
                    std::span<const SolverBody> bodies) {
  double sum = 0.0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Vec3 spin = inverse_of_symmetric(bodies[i].inverse_inertia) * bodies[i].angular;
    sum += 0.5 * (scene.bodies[index_of(ids[i])].mass_kg * bodies[i].linear.squaredNorm() +
                  spin.dot(bodies[i].angular));
  }
  return sum;
}

// Joints that nearly contradict each other can throw bodies: a step that should keep the energy and
// gives far more than its error would.
bool throws(const SceneDescription& scene, std::span<const BodyId> ids,
            std::span<const BodyState> from, std::span<const BodyState> to) {
  constexpr double kMost = 0.01;
  const double before = kinetic_joule(scene, ids, from), after = kinetic_joule(scene, ids, to);
  const double gain = gain_joule(scene, ids, from, to);
  return !(gain <= kMost * (after + before + std::abs(after - before - gain)));
}

}  // namespace

int solve_with_joints(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                      std::span<const BodyState> states, JointSystem& joints,
                      ContactProblem& problem) {
  constexpr int kAims = 3;
  constexpr double kSoftness = 1e-8;
  const int sweeps = problem.normals.empty() ? 1 : scene.solver.iterations;
  const std::span<SolverBody> bodies = problem.bodies;
  build_joint_rows(scene, dt_s, ids, states, true, joints);
  bound_step(dt_s, joints);
  // Aimed at the step's end, joints that nearly contradict each other can throw bodies. The first
  // solution only takes away from what moves against them.
  const bool is_rigid = problem.normals.empty() && !joints.bounded && !has_springs(scene, joints);
  const double most_joule = is_rigid ? 1.1 * moving_joule(scene, ids, bodies) : 0.0;
  double error = 0.0;
  int done = 0;
  ContactProblem best;
  JointSystem best_joints;
  for (int aim = 0; aim <= kAims; ++aim) {
    const double softness = aim == 0 ? 0.0 : kSoftness;
    factor_joint_rows(ids.size(), bodies, joints, softness);
    for (int i = 0; i < sweeps; ++i, ++done) {
      if (!problem.normals.empty()) solve_velocities(1, problem);
      solve_bounded(ids.size(), bodies, softness, joints);
    }
    JointSystem next = joints;
    build_joint_rows(scene, dt_s, ids, drifted(scene, ids, states, bodies, dt_s), true, next);
    const double before = std::exchange(error, largest_error(next));
    if (aim > 0 && !(error < before)) break;
    if (aim > 0 && is_rigid && moving_joule(scene, ids, bodies) > most_joule) break;
    best = problem;
    best_joints = joints;
    take_back_joint_impulses(joints, bodies);
    bound_step(dt_s, next);
    aim_joint_rows(dt_s, best.bodies, next);
    joints = std::move(next);
  }
  problem = std::move(best);
  joints = std::move(best_joints);
  return done;
}

double close_joints(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                    JointSystem& joints, std::span<BodyState> states) {
  std::vector<JointMove> moves;
  const double enough = rounding_of(states);
  build_joint_rows(scene, dt_s, ids, states, false, joints);
  double error = largest_error(joints), work_joule = 0.0;
  for (int i = 0; i < kMostCorrections && error > enough; ++i) {
    const std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
    hold_passed_limits(enough, joints);
    factor_joint_rows(ids.size(), bodies, joints);
    solve_joint_errors(joints, bodies, moves);
    std::vector<BodyState> moved(states.begin(), states.end());
    double work = 0.0;
    for (std::size_t b = 0; b < moved.size(); ++b) {
      const BodyParams& params = scene.bodies[index_of(ids[b])];
      moved[b].position_m += moves[b].linear;
      const double spinning = spin_energy_joule(params, moved[b]);
      moved[b].orientation = turned(moves[b].angular, moved[b].orientation);
      work += spin_energy_joule(params, moved[b]) - spinning -
              params.mass_kg * scene.gravity_m_s2.dot(moves[b].linear);
    }
    build_joint_rows(scene, dt_s, ids, moved, false, joints);
    const double after = largest_error(joints);
    if (!(after < 0.9 * error)) break;  // a place that cannot be reached, or rounding
    error = after;
    work_joule += work;
    std::move(moved.begin(), moved.end(), states.begin());
  }
  return work_joule;
}

void report_joints(std::span<const BodyState> states, const JointSystem& joints,
                   IslandReport& report) {
  for (const JointRow& row : joints.rows) {
    if (row.b != states.size()) continue;
    report.static_impulse_newton_s -= row.linear * row.impulse_newton_s;
    report.static_angular_impulse_newton_m_s -=
        row.turn_a * row.impulse_newton_s +
        states[row.a].position_m.cross(row.linear * row.impulse_newton_s);
  }
}

bool advance_linkage(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     JointSystem& joints, std::span<BodyState> states, IslandReport& report,
                     std::vector<AdvanceFault>& faults) {
  const bool fourth = is_reversible(scene, ids, joints);
  const int substeps = substeps_of(scene, dt_s, ids, states, fourth, joints);
  const double part_s = dt_s / substeps;
  std::vector<BodyState> next(states.begin(), states.end());
  IslandReport linked = report;
  for (int i = 0; i < substeps; ++i) {
    if (!fourth && !advance_linkage_once(scene, part_s, ids, joints, next, linked)) return false;
    if (!fourth) continue;
    for (const double stage : kStages)
      if (!advance_linkage_once(scene, stage * part_s, ids, joints, next, linked)) return false;
  }
  if (fourth && throws(scene, ids, states, next)) return false;
  if (!fourth) {
    const Vec3 by_world = linked.static_impulse_newton_s - report.static_impulse_newton_s;
    linked.static_impulse_newton_s += unforeseen_newton_s(scene, dt_s, ids, states, next, by_world);
  }
  report = linked;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].impulses.clear();
    const char* fault = fault_of(next[i]);
    if (*fault)
      faults.push_back({ids[i], fault});
    else
      states[i] = std::move(next[i]);
  }
  return true;
}

void report_lost_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds,
                        std::vector<AdvanceFault>& faults) {
  std::vector<std::uint32_t> found(ids.size() + 1, 0);
  const auto place = [&ids](BodyId id) {
    return is_static(id) ? ids.size()
                         : static_cast<std::size_t>(std::lower_bound(ids.begin(), ids.end(), id) -
                                                    ids.begin());
  };
  for (const ContactManifold& manifold : manifolds) {
    if (!is_joint(manifold)) continue;
    ++found[place(manifold.a)];
    ++found[place(manifold.b)];
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (found[i] < scene.bodies[index_of(ids[i])].joints)
      faults.push_back({ids[i], "the other body of a joint is out of its reach"});
}

}  // namespace soda::physics
