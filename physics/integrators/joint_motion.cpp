#include "physics/integrators/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "physics/constraints/joint_bounds.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/constraints/ways.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/joint_blocks.hpp"
#include "physics/solvers/joint_work.hpp"

namespace soda::physics {

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

void drift_to(const SceneDescription& scene, std::span<const BodyId> ids,
              std::span<const BodyState> states, std::span<const SolverBody> bodies, double dt_s,
              std::span<BodyState> next) {
  for (std::size_t i = 0; i < ids.size(); ++i) {
    next[i].position_m = states[i].position_m + bodies[i].linear * dt_s;
    next[i].orientation = states[i].orientation;
    next[i].linear_velocity_m_s = bodies[i].linear;
    next[i].angular_velocity_rad_s = bodies[i].angular;
    rotate_freely(scene.bodies[index_of(ids[i])], dt_s, next[i]);
  }
}

std::vector<BodyState> drifted(const SceneDescription& scene, std::span<const BodyId> ids,
                               std::span<const BodyState> states,
                               std::span<const SolverBody> bodies, double dt_s) {
  std::vector<BodyState> next(states.size());
  drift_to(scene, ids, states, bodies, dt_s, next);
  return next;
}

namespace {

constexpr int kMostCorrections = 20;

// What joints were off by at the step's start is not to be closed by velocities.
void forgive(std::span<const JointRow> start, JointSystem& system) {
  for (std::size_t r = 0; r < start.size(); ++r) {
    if (start[r].kind == JointRowKind::kHolds) system.rows[r].error -= start[r].error;
    if (start[r].kind == JointRowKind::kLimit)
      system.rows[r].error -= std::min(start[r].error, 0.0);
  }
}

void count(const NewtonOutcome& outcome, const Elimination& plan, ContactSolution& solution) {
  solution.iterations += static_cast<std::uint32_t>(outcome.steps);
  solution.multiplications +=
      static_cast<std::uint64_t>(outcome.factorisations * plan.multiplications);
}

// The rows at the poses that the step would lead to, aimed so that the joints hold there; from the
// impulses found on. Returns by how much they do not hold yet.
double aim_again(const JointedStep& step, std::span<const JointRow> start,
                 const JointSystem& solved, std::span<const SolverBody> bodies, JointSystem& next) {
  const auto& [scene, dt_s, ids, states, free] = step;
  next = solved;
  build_joint_rows(scene, dt_s, drifted(scene, ids, states, bodies, dt_s), true, next);
  forgive(start, next);
  bound_step(dt_s, next);
  aim_joint_rows(dt_s, bodies, next);
  for (std::size_t r = 0; r < next.rows.size(); ++r)
    next.rows[r].impulse_newton_s = solved.rows[r].impulse_newton_s;
  return largest_error(next);
}

// Velocities at the end of the step. Joints pull in the directions that they have at the end of the
// step: stable however taut. False, and no change of the problem, if no solution is found.
bool solve_aimed(const JointedStep& step, bool accurate, const Elimination& plan,
                 JointSystem& joints, ContactProblem& problem, ContactSolution& solution) {
  constexpr int kAims = 1;
  const auto& [scene, dt_s, ids, states, free] = step;
  build_joint_rows(scene, dt_s, states, true, joints);
  const std::vector<JointRow> start = joints.rows;
  bound_step(dt_s, joints);
  if (scene.solver.warm_starting) load_joint_impulses(scene, states, joints);
  JointSystem trial_joints = joints, next;
  ContactProblem trial = problem;
  double before = 0.0;
  for (int aim = 0; aim <= kAims; ++aim) {
    const NewtonOutcome outcome = solve_directly(accurate, free, plan, trial, &trial_joints);
    count(outcome, plan, solution);
    if (!outcome.converged) return aim > 0;
    const double error = aim_again(step, start, trial_joints, trial.bodies, next);
    if (aim > 0 && !(error < before)) return true;
    before = error;
    problem = trial;
    joints = trial_joints;
    if (error <= rounding_of(states)) return true;
    std::swap(trial_joints, next);
  }
  return true;
}

}  // namespace

double close_joints(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                    JointSystem& joints, std::span<BodyState> states) {
  std::vector<JointMove> moves;
  const double enough = rounding_of(states);
  build_joint_rows(scene, dt_s, states, false, joints);
  if (factor_multiplications(joints) > kMostJointMultiplications) return 0.0;
  double error = largest_error(joints), work_joule = 0.0;
  JointSystem held;  // limits that were passed stay held, or others push past them again
  for (int i = 0; i < kMostCorrections && error > enough; ++i) {
    const std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
    if (i == 0) hold_passed_limits(enough, joints);
    if (joints.bounded) held = joints;
    factor_joint_rows(ids.size(), bodies, joints);
    solve_joint_errors(joints, bodies, moves);
    std::vector<BodyState> moved(states.begin(), states.end());
    double work = 0.0;
    for (std::size_t b = 0; b < moved.size(); ++b) {
      const BodyParams& params = scene.bodies[index_of(ids[b])];
      moved[b].position_m += moves[b].linear;
      turn_by(params, moves[b].angular, moved[b]);
      work -= params.mass_kg * scene.gravity_m_s2.dot(moves[b].linear);
    }
    build_joint_rows(scene, dt_s, moved, false, joints);
    const double after = largest_error(joints);
    if (joints.bounded) hold_same_limits(held, joints);
    const bool more = hold_passed_limits(enough, joints);
    if (!(after < 0.9 * error) && !more) break;  // a place that cannot be reached, or rounding
    error = after;
    work_joule += work;
    std::move(moved.begin(), moved.end(), states.begin());
  }
  return work_joule;
}

bool limit_throws(const JointedStep& step, double parting_m_s, std::span<SolverBody> bodies) {
  constexpr double kMostOfOthers = 30.0, kMostOfOwn = 3.0;
  const std::size_t count = step.ids.size();
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return step.free[i].inverse_mass; });
  const auto speed_m_s = [](const SolverBody& body, const Vec3& linear, const Vec3& angular) {
    return linear.norm() +
           std::sqrt(body.inverse_mass / body.inverse_inertia.norm()) * angular.norm();
  };
  double heavier_m_s = 0.0;
  bool limited = false;
  for (const std::uint32_t i : order) {
    const SolverBody& start = step.free[i];
    SolverBody& body = bodies[i];
    const double own = std::max(speed_m_s(start, start.linear, start.angular),
                                speed_m_s(start, step.states[i].linear_velocity_m_s,
                                          step.states[i].angular_velocity_rad_s));
    const double most = parting_m_s + std::max(kMostOfOwn * own, kMostOfOthers * heavier_m_s);
    heavier_m_s = std::max(heavier_m_s, own);
    const double now = speed_m_s(body, body.linear, body.angular);
    if (!(now > most)) continue;
    body.linear *= most / now;
    body.angular *= most / now;
    limited = true;
  }
  return limited;
}

std::optional<ContactSolution> solve_jointed(const JointedStep& step, bool accurate,
                                             const Elimination& plan, JointSystem& joints,
                                             ContactProblem& problem) {
  ContactSolution solution;
  if (!solve_aimed(step, accurate, plan, joints, problem, solution)) return std::nullopt;
  solution.direct = true;
  limit_throws(step, 0.0, problem.bodies);
  if (!needs_push_out(problem)) return solution;
  count(push_out_directly(step.dt_s, plan, problem, solution.push, &joints), plan, solution);
  limit_push_out(fastest_push_out_m_s(step.scene, step.ids), solution.push);
  return solution;
}

namespace {

// The bodies at their final velocities for a part of the step, joints closed.
void moved_for(double time_s, const JointedStep& step, const JointSystem& solved,
               const ContactProblem& problem, std::span<BodyState> states,
               std::vector<AdvanceFault>& faults) {
  Flights flights = find_flights(problem);
  for (const JointRow& row : solved.rows)
    flights[row.a].supported = flights[row.b].supported = true;
  for (std::size_t i = 0; i < step.ids.size(); ++i)
    move_body(step.scene, time_s, step.ids[i], problem.bodies[i], flights[i], nullptr, states[i],
              faults);
  JointSystem joints = solved;
  close_joints(step.scene, step.dt_s, step.ids, joints, states);
}

// What no velocity was left for. A motor that brakes what rests has taken nothing. The rest is
// closing: of what was open before, if the bodies have not moved; else at most what places that
// hold to rounding lift what hangs on them.
void add_untaken(double rest_joule, bool moved, const JointedStep& step, IslandReport& report) {
  constexpr double kRounding = 1e-12;
  const double braked = std::max(0.0, -report.motor_work_joule);
  if (rest_joule < (1.0 - kRounding) * braked) {
    report.motor_work_joule += rest_joule;
    return;
  }
  if (braked > 0.0) report.motor_work_joule = 0.0;
  report.push_out_work_joule += std::max(rest_joule - braked, 0.0);
}

}  // namespace

bool are_closed(const SceneDescription& scene, double dt_s, std::span<const BodyState> states,
                JointSystem& joints) {
  build_joint_rows(scene, dt_s, states, false, joints);
  return largest_error(joints) <= 100.0 * rounding_of(states);
}

void close_left_open(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     JointSystem& joints, std::span<BodyState> states, IslandReport& report) {
  if (are_closed(scene, dt_s, states, joints)) return;
  report.push_out_work_joule += close_joints(scene, dt_s, ids, joints, states);
}

double most_push_out_joule(const JointedStep& step, std::span<const BodyState> after) {
  const double g = step.scene.gravity_m_s2.norm();
  const double pushed_m_s = fastest_push_out_m_s(step.scene, step.ids) + g * step.dt_s;
  double most = 0.0;
  for (std::size_t i = 0; i < step.ids.size(); ++i)
    most +=
        step.scene.bodies[index_of(step.ids[i])].mass_kg *
        (pushed_m_s + (after[i].linear_velocity_m_s - step.states[i].linear_velocity_m_s).norm());
  return most * g * step.dt_s;
}

void move_jointed(const JointedStep& step, const JointSystem& solved, const ContactProblem& problem,
                  std::span<const PushOut> push, std::span<BodyState> states, IslandReport& report,
                  std::vector<AdvanceFault>& faults) {
  constexpr double kMostTaken = 0.5;  // of the energy of motion
  constexpr double kLeastShare = 1.0 / 64;
  const auto& [scene, dt_s, ids, before, free] = step;
  report.motor_work_joule = motor_work_joule(solved, problem.bodies);
  const double pushed =
      report.motor_work_joule + external_work_joule(scene, dt_s, before, free, problem);
  const auto elastic = [&, sprung = has_springs(scene, solved)](std::span<const BodyState> at) {
    return sprung ? elastic_joule(spring_rows(scene, at, solved)) : 0.0;
  };
  const double lent = elastic(before);
  // Where the way bends so much within the step that closing what it opened takes more than there
  // is, the bodies come less far.
  std::vector<BodyState> next;
  EnergyExcess excess;
  double share = 1.0;
  for (;; share = share > kLeastShare ? 0.5 * share : 0.0) {
    next.assign(before.begin(), before.end());
    std::vector<AdvanceFault> found;
    moved_for(share * dt_s, step, solved, problem, next, found);
    if (share == 0.0) report.motor_work_joule = 0.0;  // nothing moves, so nothing works
    excess = energy_excess(scene, dt_s, ids, before, next,
                           (share > 0.0 ? pushed : 0.0) + lent - elastic(next));
    if (!excess.is_trace(kMostTaken) && share > 0.0) continue;
    faults.insert(faults.end(), found.begin(), found.end());
    break;
  }
  std::move(next.begin(), next.end(), states.begin());
  if (excess.gain_joule > 0.0) {
    const double rest =
        take_excess(scene, ids, excess, is_afloat(ids.size(), solved, &problem), states, report);
    add_untaken(rest, share > 0.0, step, report);
  }
  if (push.empty()) return;
  std::vector<BodyState> parted(states.begin(), states.end());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    parted[i].position_m += push[i].linear * dt_s;
    turn_by(scene.bodies[index_of(ids[i])], push[i].angular * dt_s, parted[i]);
  }
  JointSystem joints = solved;
  const double work = push_out_work_joule(scene, dt_s, ids, push) +
                      close_joints(scene, dt_s, ids, joints, parted) + elastic(parted) -
                      elastic(states);
  if (!(report.push_out_work_joule + work <= most_push_out_joule(step, parted))) return;
  report.push_out_work_joule += work;
  std::ranges::move(parted, states.begin());
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
      faults.push_back({ids[i], "is pulled farther from a joint's other body than its reach_m"});
}

}  // namespace soda::physics
