#include "physics/integrators/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/constraints/joint_impulses.hpp"
#include "physics/constraints/limits_and_motors.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/integrators/giving_way.hpp"
#include "physics/integrators/joint_closing.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/joint_stiffness.hpp"
#include "physics/solvers/joint_work.hpp"
#include "physics/solvers/jointed_contacts.hpp"
#include "physics/solvers/unconstrained_reference.hpp"

namespace soda::physics {

double rounding_of(std::span<const BodyState> states, double reach_m) {
  double largest = reach_m;
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

// How often joints are aimed at the poses that the step leads to; and beside contacts the part of
// the error before at which the next time is not needed. Taut chains, which halve their sag, go on
// beyond it. Joints alone go on to rounding, which takes little.
constexpr int kMostAims = 10;
constexpr double kConverges = 0.1;
// Of masses, for Newton's method and stiffness: between more unequal ones rounding is all that the
// light ones get.
constexpr double kMostRatio = 1e4;

// What joints were off by at the step's start is not to be closed by velocities.
void forgive(std::span<const JointRow> start, JointSystem& system) {
  for (std::size_t r = 0; r < start.size(); ++r) {
    if (start[r].kind == JointRowKind::kHolds) system.rows[r].error -= start[r].error;
    if (start[r].kind == JointRowKind::kLimit)
      system.rows[r].error -= std::min(start[r].error, 0.0);
  }
}

void take_joint_impulses(const JointSystem& from, JointSystem& to) {
  for (std::size_t r = 0; r < to.rows.size(); ++r)
    to.rows[r].impulse_newton_s = from.rows[r].impulse_newton_s;
}

struct BothSolved {
  std::uint32_t iterations = 0;
  bool through = true;  // every contact met all that hangs on its bodies
};

// Iterations over contacts, seen through the joints where that costs little, alternate with the
// exact solution of all joints, which comes last.
BothSolved solve_both(const JointedStep& step, JointSystem& joints, ContactProblem& problem) {
  constexpr int kRounds = 4;  // limits and motors change which joints take part
  const std::span<SolverBody> bodies = problem.bodies;
  const int iterations = step.island.scene.solver.iterations;
  solve_bounded(bodies, 0.0, joints);
  if (problem.normals.empty()) return {1, true};
  std::uint32_t done = 0;
  double change = 1e300;
  for (int round = 0; round < (joints.bounded ? kRounds : 1); ++round) {
    const std::optional<JointedContacts> contacts = jointed_contacts(joints, problem);
    if (!contacts) {
      for (int i = 0; i < iterations && !is_out_of_bounds(problem); ++i, ++done) {
        solve_velocities(1, problem);
        solve_bounded(bodies, 0.0, joints);
      }
      return {done, false};
    }
    ContactProblem through = problem;
    const JointedSolve solve = solve_jointed_velocities(10 * iterations, *contacts, through);
    done += static_cast<std::uint32_t>(solve.iterations);
    take_contact_impulses(through, problem);
    solve_bounded(bodies, 0.0, joints);
    if (is_stalled(solve.change, std::exchange(change, solve.change))) break;
  }
  return {done, true};
}

// Velocities at the end of the step. Joints pull in the directions that they have at the end of the
// step (implicit: stable however taut). Returns the number of iterations.
std::uint32_t solve_alternately(const JointedStep& step, JointSystem& joints,
                                ContactProblem& problem) {
  const auto& [island, states, free] = step;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const std::span<SolverBody> bodies = problem.bodies;
  const double enough = rounding_of(states, joints.reach_m);
  const bool even = mass_ratio(scene, ids) <= kMostRatio;
  build_joint_rows(scene, dt_s, states, true, joints);
  const std::vector<JointRow> start = joints.rows;
  bound_step(dt_s, joints);
  double error = 0.0;
  std::uint32_t done = 0;
  bool through = false;
  ContactProblem best;
  JointSystem best_joints;
  for (int aim = 0; aim <= kMostAims; ++aim) {
    factor_joint_rows(bodies, joints);
    const BothSolved both = solve_both(step, joints, problem);
    done += both.iterations;
    const bool diverged = is_out_of_bounds(problem);
    if (aim > 0 && (diverged || (through && !both.through))) break;
    through = both.through;
    if (diverged) return done;  // clamp_joint_gain goes back to joints alone
    const std::vector<BodyState> there = drifted(scene, ids, states, bodies, dt_s);
    JointSystem next = joints;
    build_joint_rows(scene, dt_s, there, true, next);
    forgive(start, next);
    const double before = std::exchange(error, largest_error(next));
    if (aim > 0 && !(error < before)) break;
    best = problem;
    best_joints = joints;
    const bool converges = aim > 0 && !problem.normals.empty() && error <= kConverges * before;
    if (error <= enough || converges) break;
    bound_step(dt_s, next);
    aim_joint_rows(dt_s, best.bodies, next);
    if (even)
      stiffen(scene, dt_s, there, joints, free, bodies);
    else
      std::copy(free.begin(), free.end(), bodies.begin());
    forget_impulses(problem);
    take_contact_impulses(best, problem);
    joints = std::move(next);
  }
  problem = std::move(best);
  joints = std::move(best_joints);
  unstiffen(free, problem.bodies);
  return done;
}

// As at the step's start, from the impulses of the step before, which the bodies' guess follows.
void start_joints(const JointedStep& step, JointSystem& joints, ContactProblem& problem) {
  const SceneDescription& scene = step.island.scene;
  build_joint_rows(scene, step.island.dt_s, step.states, true, joints);
  bound_step(step.island.dt_s, joints);
  if (!scene.solver.warm_starting) return;
  load_joint_impulses(scene, step.states, joints);
  for (const JointRow& row : joints.rows)
    apply_joint_impulse(row, row.impulse_newton_s, problem.bodies);
}

// Velocities at the end of the step. Joints pull in the directions that they have at the end of the
// step: stable however taut. `joints` as at its start. False, and no change of the problem, if no
// solution is found.
bool solve_aimed(const JointedStep& step, const DirectAim& how, const Elimination& plan,
                 JointSystem& joints, ContactProblem& problem, ContactSolution& solution) {
  const auto& [island, states, free] = step;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const std::vector<JointRow> start = joints.rows;
  JointSystem trial_joints = joints;
  ContactProblem trial = problem;
  std::vector<SolverBody> from(free.begin(), free.end());
  double before = 0.0;
  for (int aim = 0; aim <= kMostAims; ++aim) {
    const NewtonOutcome outcome = solve_directly(how, from, plan, trial, &trial_joints);
    count(outcome, plan, solution);
    if (!outcome.converged && aim == 0) return false;
    if (!outcome.converged) break;
    const std::vector<BodyState> there = drifted(scene, ids, states, trial.bodies, dt_s);
    JointSystem next = trial_joints;
    build_joint_rows(scene, dt_s, there, true, next);
    forgive(start, next);
    const double error = largest_error(next);
    if (aim > 0 && !(error < before)) break;
    problem = trial;
    joints = trial_joints;
    const bool converges = aim > 0 && error <= kConverges * before;
    if (converges || error <= rounding_of(states, joints.reach_m)) break;
    before = error;
    bound_step(dt_s, next);
    aim_joint_rows(dt_s, trial.bodies, next);
    take_joint_impulses(joints, next);
    std::copy_n(problem.bodies.begin(), from.size(), from.begin());
    stiffen(scene, dt_s, there, joints, free, from);
    trial_joints = std::move(next);
  }
  unstiffen(free, problem.bodies);
  return true;
}

}  // namespace

std::optional<ContactSolution> solve_jointed_directly(const JointedStep& step, bool accurate,
                                                      const Elimination& plan, JointSystem& joints,
                                                      ContactProblem& problem) {
  if (problem.normals.empty()) return std::nullopt;
  if (mass_ratio(step.island.scene, step.island.ids) > kMostRatio) return std::nullopt;
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  // In motion the next step solves again, and what Newton's method has come to is nearer than what
  // iterations would find.
  constexpr double kStalled = 1e-4, kMoving = 0.2;
  DirectAim how = accurate ? kByItself : kOngoing;
  if (!accurate) how.of_motion = kOfMotion;
  how.rests = accurate || is_quasi_static(scene, dt_s, ids, manifolds, step.states);
  if (!how.rests) {
    how.stalled = kStalled;
    how.accepted = kMoving;
  }
  ContactProblem solved = problem;
  JointSystem start = joints;
  start_joints(step, start, solved);
  JointSystem solved_joints = start;
  ContactSolution solution;
  const auto solve = [&] {
    if (!solve_aimed(step, how, plan, solved_joints, solved, solution)) return false;
    if (limit_throws(step.states, step.free, solved_joints, solved)) return false;
    clamp_joint_gain(step.island.dt_s, step.states, step.free, solved_joints, solved);
    return true;
  };
  if (!solve()) return std::nullopt;
  if (solved.restitution_rows > 0 && set_restitution_targets(solved)) {
    take_joint_impulses(solved_joints, start);
    solved_joints = start;
    if (!solve()) return std::nullopt;
  }
  joints = std::move(solved_joints);
  problem = std::move(solved);
  solution.direct = true;
  if (!needs_position_correction(problem)) return solution;
  count(correct_positions_directly(step.island.dt_s, plan, problem, solution.push, &joints), plan,
        solution);
  limit_correction(fastest_correction(step.island.scene, step.island.ids), solution.push);
  return solution;
}

ContactSolution solve_jointed(const JointedStep& step, JointSystem& joints,
                              ContactProblem& problem) {
  ContactSolution solution;
  solution.iterations = solve_alternately(step, joints, problem);
  clamp_joint_gain(step.island.dt_s, step.states, step.free, joints, problem);
  limit_throws(step.states, step.free, joints, problem);
  const ContactProblem plastic = problem;
  const JointSystem plastic_joints = joints;
  if (problem.restitution_rows > 0 && set_restitution_targets(problem)) {
    take_back_joint_impulses(joints, problem.bodies);
    solution.iterations += solve_alternately(step, joints, problem);
    clamp_joint_gain(step.island.dt_s, step.states, step.free, joints, problem);
    limit_throws(step.states, step.free, joints, problem);
  }
  PositionCorrectionProblem push;
  solve_position_correction(step.island.scene.solver.iterations, step.island.dt_s, problem, push);
  solution.push = std::move(push.bodies);
  limit_correction(fastest_correction(step.island.scene, step.island.ids), solution.push);
  return solution;
}

namespace {

// The bodies at their final velocities for a part of the step, joints closed, and what lies on them
// out of their way.
GivenWay moved_for(double time_s, const JointedStep& step, const JointedSolution& solved,
                   std::span<BodyState> states, std::vector<AdvanceFault>& faults) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  Flights flights = find_flights(solved.problem);
  for (const JointRow& row : solved.joints.rows)
    flights[row.a].supported = flights[row.b].supported = true;
  for (std::size_t i = 0; i < ids.size(); ++i)
    move_body({scene, time_s, ids[i], solved.problem.bodies[i], flights[i], nullptr}, states[i],
              faults);
  JointSystem joints = solved.joints;
  const std::vector<BodyState> open(states.begin(), states.end());
  close_joints(scene, dt_s, ids, kinetic_joule(scene, ids, states), joints, states);
  return give_way(step.island, {time_s, step.states, open}, joints, solved.problem, states);
}

// Position correction; then joints are closed once more, and what lies on them gives way. All of
// that lifts no more than position correction may.
void push_apart(const JointedStep& step, const JointedSolution& solved, std::span<BodyState> states,
                IslandReport& report) {
  const auto& [island, before, free] = step;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [joints, problem, push] = solved;
  const double moved = elastic_joule(scene, joints, states);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    states[i].position_m += push[i].linear * dt_s;
    rotate_by(scene.bodies[index_of(ids[i])], push[i].angular * dt_s, states[i]);
  }
  JointSystem closed = joints;
  const double lifted = push_out_work_joule(scene, dt_s, ids, push);
  report.push_out_work_joule += lifted;
  const std::vector<BodyState> open(states.begin(), states.end());
  double fastest_m_s = 0.0;
  for (const PositionCorrection& body : push)
    fastest_m_s = std::max(fastest_m_s, body.linear.norm());
  const double weight_dt = weight_newton(scene, ids) * dt_s;
  double left =
      std::max(0.0, weight_dt * fastest_correction(scene, ids).m_s - std::max(0.0, lifted));
  const double closing =
      close_joints(scene, dt_s, ids, std::min(left, weight_dt * fastest_m_s), closed, states);
  left = std::max(0.0, left - std::max(0.0, closing));
  report.push_out_work_joule +=
      closing + give_way(island, {0.0, before, open, left}, closed, problem, states).work_joule;
  report.push_out_work_joule += elastic_joule(scene, joints, states) - moved;
}

// What no velocity was left for. A motor that brakes what rests has taken nothing. The rest is
// closing: of what was open before, if the bodies have not moved; else at most what places that
// hold to rounding lift what hangs on them. `most_lift_m`: of which of both.
void add_untaken(double rest_joule, double most_lift_m, const JointedStep& step,
                 IslandReport& report) {
  constexpr double kRounding = 1e-12;
  const double braked = std::max(0.0, -report.motor_work_joule);
  if (rest_joule < (1.0 - kRounding) * braked) {
    report.motor_work_joule += rest_joule;
    return;
  }
  if (braked > 0.0) report.motor_work_joule = 0.0;
  const double weight = weight_newton(step.island.scene, step.island.ids);
  const double lifted = rest_joule - braked;
  if (lifted > 0.0 && !(lifted > most_lift_m * weight)) report.push_out_work_joule += lifted;
}

}  // namespace

void move_jointed(const JointedStep& step, const JointedSolution& solved,
                  std::span<BodyState> states, IslandReport& report,
                  std::vector<AdvanceFault>& faults) {
  constexpr double kMostTaken = 0.5;  // of the energy of motion
  constexpr double kLeastShare = 1.0 / 64;
  constexpr double kHelps = 0.9;  // of the energy at the share before
  constexpr double kRoundings = 100.0;
  const auto& [island, before, free] = step;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [joints, problem, push] = solved;
  report.motor_work_joule = motor_work_joule(joints, problem.bodies);
  const double pushed = report.motor_work_joule +
                        external_work_joule(scene, dt_s, ids, before, free, problem) +
                        kinematic_work_joule(free, problem);
  const double lent = elastic_joule(scene, joints, before);
  // Where the path bends so much within the step that closing what it opened takes more than there
  // is, the bodies come less far; where that does not help, as in a knot, they stay.
  std::vector<BodyState> next;
  EnergyExcess excess;
  double share = 1.0;
  GivenWay given;
  for (double before_joule = 1e300;; before_joule = excess.gain_joule) {
    next.assign(before.begin(), before.end());
    std::vector<AdvanceFault> found;
    given = moved_for(share * dt_s, step, solved, next, found);
    excess = energy_excess(scene, dt_s, ids, before, next,
                           pushed + lent - elastic_joule(scene, joints, next));
    if (excess.is_trace(kMostTaken) || !(share > 0.0)) {
      faults.insert(faults.end(), found.begin(), found.end());
      break;
    }
    const bool helps = excess.gain_joule < kHelps * before_joule;
    share = helps && share > kLeastShare ? 0.5 * share : 0.0;
  }
  std::move(next.begin(), next.end(), states.begin());
  report.static_impulse_newton_s += given.by_world_newton_s;
  report.static_angular_impulse_newton_m_s += given.by_world_newton_m_s;
  if (excess.gain_joule > 0.0) {
    const double rest =
        take_excess(scene, ids, excess, is_isolated(ids.size(), joints, &problem), states, report);
    const double aside = std::clamp(rest, 0.0, std::max(0.0, given.work_joule));
    report.push_out_work_joule += aside;
    const double most_lift_m = share > 0.0 ? kRoundings * rounding_of(before, joints.reach_m)
                                           : std::numeric_limits<double>::infinity();
    if (rest > aside) add_untaken(rest - aside, most_lift_m, step, report);
  }
  if (!push.empty()) push_apart(step, solved, states, report);
}

}  // namespace soda::physics
