#include "physics/integrators/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/constraints/joint_impulses.hpp"
#include "physics/constraints/limits_and_motors.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/direct_contacts.hpp"
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
constexpr int kMostAims = 20;
constexpr double kConverges = 0.1;
// How many in a row may be worse than the best: a bent rope that becomes taut is off by more before
// it comes nearer, and what is left open there tears, for it takes the load's whole energy to
// close.
constexpr int kMostWorse = 3;

// Which solutions are worth going on from.
struct Aims {
  double before = 0.0, least = 0.0;
  int worse = 0;
  bool any = false;

  // Whether it is the best so far.
  bool add(double error) {
    const bool best = !std::exchange(any, true) || error < least;
    worse = best ? 0 : worse + 1;
    if (best) least = error;
    return best;
  }
  // Whether the one that was added last, of this error, converges.
  bool converges(double error) {
    return error <= kConverges * std::exchange(before, error) && worse == 0;
  }
};

// What joints were off by at the step's start is not to be closed by velocities.
void forgive(std::span<const JointRow> start, JointSystem& system) {
  for (std::size_t r = 0; r < start.size(); ++r) {
    if (start[r].kind == JointRowKind::kHolds) system.rows[r].error -= start[r].error;
    if (start[r].kind == JointRowKind::kLimit)
      system.rows[r].error -= std::min(start[r].error, 0.0);
  }
}

// By how much springs are longer or shorter there than they pull for, as far as that moves their
// bodies. `solved` has the rows that were solved for the bodies' velocities, `there` the same ones
// where these lead.
double spring_error_m(double dt_s, std::span<const SolverBody> bodies, const JointSystem& solved,
                      const JointSystem& there) {
  double largest = 0.0;
  for (std::size_t r = 0; r < there.rows.size(); ++r) {
    const JointRow& row = solved.rows[r];
    if (row.kind != JointRowKind::kSpring) continue;
    const SolverBody &a = bodies[row.a], &b = bodies[row.b];
    const double response = a.inverse_mass + b.inverse_mass +
                            row.angular_a.dot(times(a.inverse_inertia, row.angular_a)) +
                            row.angular_b.dot(times(b.inverse_inertia, row.angular_b));
    const double foreseen_m =
        dt_s * velocity_of(row, bodies) - row.target_m_s / row.stiffness_share_1_s;
    const double moves = response / (response + row.softness_1_kg);
    largest = std::max(largest, moves * std::abs(there.rows[r].error - foreseen_m));
  }
  return largest;
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
  const bool even = are_even(scene, ids);
  build_joint_rows(scene, dt_s, states, true, joints);
  const std::vector<JointRow> start = joints.rows;
  bound_step(dt_s, joints);
  Aims aims;
  std::uint32_t done = 0;
  bool through = false;
  ContactProblem best;
  JointSystem best_joints;
  for (int aim = 0; aim <= kMostAims && aims.worse <= kMostWorse; ++aim) {
    factor_joint_rows(bodies, joints);
    const BothSolved both = solve_both(step, joints, problem);
    done += both.iterations;
    drop_stiffness_rows(joints);
    const bool diverged = is_out_of_bounds(problem);
    if (aim > 0 && (diverged || (through && !both.through))) break;
    through = both.through;
    if (diverged) return done;  // clamp_joint_gain goes back to joints alone
    const std::vector<BodyState> there = drifted(scene, ids, states, bodies, dt_s);
    JointSystem next = joints;
    build_joint_rows(scene, dt_s, there, true, next);
    forgive(start, next);
    const double error = std::max(largest_error(next), spring_error_m(dt_s, bodies, joints, next));
    const ContactProblem found = problem;
    if (aims.add(error)) {
      best = problem;
      best_joints = joints;
    }
    const bool converges = aims.converges(error) && !problem.normals.empty();
    if (error <= enough || converges) break;
    bound_step(dt_s, next);
    aim_joint_rows(dt_s, problem.bodies, next);
    if (even) {
      add_stiffness_rows(scene, dt_s, there, joints, bodies, next);
      stiffen(scene, dt_s, there, joints, free, bodies);
    } else {
      std::copy(free.begin(), free.end(), bodies.begin());
    }
    forget_impulses(problem);
    take_contact_impulses(found, problem);
    joints = std::move(next);
  }
  problem = std::move(best);
  joints = std::move(best_joints);
  unstiffen(free, problem.bodies);
  return done;
}

// As at the step's start, with what the step before has found: impulses, and as a guess velocities,
// for contacts can have new features, of which no impulse is known.
void start_joints(const JointedStep& step, JointSystem& joints, ContactProblem& problem) {
  const SceneDescription& scene = step.island.scene;
  build_joint_rows(scene, step.island.dt_s, step.states, true, joints);
  bound_step(step.island.dt_s, joints);
  if (!scene.solver.warm_starting) return;
  load_joint_impulses(scene, step.states, joints);
  for (std::size_t i = 0; i < step.states.size(); ++i) {
    SolverBody& body = problem.bodies[i];
    if (body.inverse_mass == 0.0) continue;  // kinematic: it goes where it is told
    body.linear = step.states[i].linear_velocity_m_s;
    body.angular = step.states[i].angular_velocity_rad_s;
  }
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
  Aims aims;
  for (int aim = 0; aim <= kMostAims && aims.worse <= kMostWorse; ++aim) {
    const NewtonOutcome outcome = solve_directly(how, from, plan, trial, &trial_joints);
    count(outcome, plan, solution);
    if (!outcome.converged && aim == 0) return false;
    if (!outcome.converged) break;
    drop_stiffness_rows(trial_joints);
    const std::vector<BodyState> there = drifted(scene, ids, states, trial.bodies, dt_s);
    JointSystem next = trial_joints;
    build_joint_rows(scene, dt_s, there, true, next);
    forgive(start, next);
    const double error =
        std::max(largest_error(next), spring_error_m(dt_s, trial.bodies, trial_joints, next));
    if (aims.add(error)) {
      problem = trial;
      joints = trial_joints;
    }
    if (aims.converges(error) || error <= rounding_of(states, joints.reach_m)) break;
    bound_step(dt_s, next);
    aim_joint_rows(dt_s, trial.bodies, next);
    take_joint_impulses(trial_joints, next);
    std::copy_n(trial.bodies.begin(), from.size(), from.begin());
    add_stiffness_rows(scene, dt_s, there, trial_joints, trial.bodies, next);
    stiffen(scene, dt_s, there, trial_joints, free, from);
    trial_joints = std::move(next);
  }
  unstiffen(free, problem.bodies);
  return true;
}

// Factorisations of an aim.
constexpr int kOfAim = 60;

// Iterations and substeps take each joint for itself, so that they get the less far the more there
// are. What moves, and has few joints beside its contacts, is left to them early.
int most_in_motion(const Elimination& plan, const JointSystem& joints) {
  constexpr double kOfRow = 2e4;  // multiplications, for each row of a joint
  constexpr int kLeast = 10;
  const double most = kOfRow * static_cast<double>(joints.rows.size()) / plan.multiplications;
  return static_cast<int>(std::clamp<double>(most, kLeast, kOfAim));
}

}  // namespace

std::optional<ContactSolution> solve_jointed_directly(const JointedStep& step, bool accurate,
                                                      const Elimination& plan, JointSystem& joints,
                                                      ContactProblem& problem) {
  if (problem.normals.empty()) return std::nullopt;
  if (!are_even(step.island.scene, step.island.ids)) return std::nullopt;
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  // In motion the next step solves again, and what Newton's method has come to is nearer than what
  // iterations would find.
  constexpr double kStalled = 1e-4, kMoving = 0.2;
  DirectAim how = accurate ? kByItself : kOngoing;
  how.factorisations = kOfAim;
  if (!accurate) how.of_motion = kOfMotion;
  if (!accurate && !is_quasi_static(scene, dt_s, ids, manifolds, step.states)) {
    how.factorisations = most_in_motion(plan, joints);
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
  PositionCorrectionProblem correction;
  solve_position_correction(step.island.scene.solver.iterations, step.island.dt_s, problem,
                            correction);
  solution.push = std::move(correction.bodies);
  limit_correction(fastest_correction(step.island.scene, step.island.ids), solution.push);
  return solution;
}

}  // namespace soda::physics
