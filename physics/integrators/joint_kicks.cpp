#include "physics/integrators/joint_kicks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/joint_stiffness.hpp"
#include "physics/solvers/joint_work.hpp"

namespace soda::physics {
namespace {

// Bodies that contacts or springs carry; kinematic ones, and the world.
std::vector<bool> held_bodies(const JointedSolution& solved) {
  std::vector<bool> held;
  for (const SolverBody& body : solved.problem.bodies) held.push_back(body.inverse_mass == 0.0);
  for (const NormalRow& row : solved.problem.normals)
    if (row.impulse_newton_s > 0.0) held[row.a] = held[row.b] = true;
  for (const JointRow& row : solved.joints.rows)
    if (row.kind == JointRowKind::kSpring) held[row.a] = held[row.b] = true;
  return held;
}

// What external forces would give without joints. What is held has no mass.
std::vector<SolverBody> given_velocities(const JointedStep& step, const JointedSolution& solved,
                                         const std::vector<bool>& held) {
  const std::span<const SolverBody> bodies = solved.problem.bodies;
  std::vector<SolverBody> given(bodies.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (held[i]) continue;
    given[i] = bodies[i];
    given[i].linear = step.free[i].linear - step.states[i].linear_velocity_m_s;
    given[i].angular = step.free[i].angular - step.states[i].angular_velocity_rad_s;
  }
  return given;
}

// Rows between bodies that are held do nothing; limits and motors that carry hold.
void hold_rows(const std::vector<bool>& held, std::span<const JointRow> end,
               std::span<JointRow> rows) {
  for (std::size_t r = 0; r < rows.size(); ++r) {
    JointRow& row = rows[r];
    if (held[row.a] && held[row.b]) row.linear = row.angular_a = row.angular_b = Vec3::Zero();
    if (!is_bounded(row) || end[r].impulse_newton_s == 0.0) continue;
    row.kind = JointRowKind::kHolds;
    row.idle = false;
  }
}

double work_of(const SolverBody& given, const SolverBody& kick) {
  const Mat3 inertia = inverse_of_symmetric(given.inverse_inertia);
  return kick.linear.dot(given.linear) / given.inverse_mass +
         kick.angular.dot(inertia * given.angular);
}

double approach_of(const NormalRow& row, std::span<const SolverBody> bodies) {
  const SolverBody &a = bodies[row.a], &b = bodies[row.b];
  return row.normal.dot(a.linear - b.linear) + row.arm_a.dot(a.angular) - row.arm_b.dot(b.angular);
}

// Of what would close this much of a gap: as much as leaves it open, whatever bends.
double share_of_gap(double gap_m, double closes_m) {
  constexpr double kOfGap = 0.9;
  return closes_m > 0.0 ? std::min(1.0, kOfGap * std::max(0.0, gap_m) / closes_m) : 1.0;
}

// Of moving back over this time: as much as lets nothing touch that does not at the step's end, nor
// come to a limit.
double share_before_touch(double time_s, const JointedStep& step, const ContactProblem& problem,
                          std::span<const JointRow> end, std::span<const SolverBody> kicks) {
  double least = 1.0;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const NormalRow& row = problem.normals[i];
    if (row.impulse_newton_s > 0.0) continue;
    const double gap_m =
        problem.contacts[i].separation_m - step.island.dt_s * approach_of(row, problem.bodies);
    least = std::min(least, share_of_gap(gap_m, -time_s * approach_of(row, kicks)));
  }
  for (const JointRow& row : end) {
    if (row.kind != JointRowKind::kLimit || row.impulse_newton_s != 0.0) continue;
    least = std::min(least, share_of_gap(row.error, time_s * velocity_of(row, kicks)));
  }
  return least;
}

// Of what holds always, and of limits that carry: these are to stay where they are. The rows before
// have the impulses of the step.
double error_at(const SceneDescription& scene, std::span<const BodyState> states,
                std::span<const JointRow> before, JointSystem& joints) {
  build_joint_errors(scene, states, joints);
  for (std::size_t r = 0; r < before.size(); ++r) {
    JointRow& row = joints.rows[r];
    if (!is_bounded(row)) continue;
    const bool carries = row.kind == JointRowKind::kLimit && before[r].impulse_newton_s != 0.0;
    row.error = carries ? row.error - before[r].error : 0.0;
  }
  return largest_error(joints);
}

bool passes_limits(std::span<const JointRow> before, std::span<const JointRow> after,
                   double rounding_m) {
  for (std::size_t r = 0; r < after.size(); ++r)
    if (after[r].kind == JointRowKind::kLimit &&
        after[r].error < std::min(before[r].error, 0.0) - rounding_m)
      return true;
  return false;
}

// Newton's method with the matrix of the kicks. Whether joints are then as closed as before, but
// for rounding, and limits are kept.
bool rejoin(const JointedStep& step, const JointKicks& kicks, std::span<const JointRow> before,
            double rounding_m, std::span<BodyState> states) {
  constexpr int kMostSteps = 10;
  constexpr double kComes = 0.5;
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  JointSystem joints = kicks.joints;
  double enough_m = rounding_m;
  for (const JointRow& row : before)
    if (row.kind == JointRowKind::kHolds) enough_m = std::max(enough_m, std::abs(row.error));
  double error_m = error_at(scene, states, before, joints);
  std::vector<JointMove> moves;
  if (!joints.factored) factor_joint_rows(kicks.bodies, joints);
  for (int i = 0; i < kMostSteps && error_m > enough_m; ++i) {
    solve_joint_errors(joints, kicks.bodies, moves);
    for (std::size_t b = 0; b < states.size(); ++b) {
      states[b].position_m += moves[b].linear;
      rotate_by(scene.bodies[index_of(ids[b])], moves[b].angular, states[b]);
    }
    const double before_m = std::exchange(error_m, error_at(scene, states, before, joints));
    if (!(error_m < kComes * before_m)) break;
  }
  if (!(error_m <= enough_m)) return false;
  build_joint_errors(scene, states, joints);
  return !passes_limits(before, joints.rows, rounding_m);
}

}  // namespace

JointSystem middle_rows(const JointedStep& step, const JointedSolution& solved) {
  const std::span<const JointRow> end = solved.joints.rows;
  JointSystem middle = solved.joints;
  build_joint_rows(step.island.scene, step.island.dt_s, step.states, true, middle);
  middle.bounded = false;
  for (std::size_t r = 0; r < end.size(); ++r) {
    JointRow& row = middle.rows[r];
    row.linear = 0.5 * (row.linear + end[r].linear);
    row.angular_a = 0.5 * (row.angular_a + end[r].angular_a);
    row.angular_b = 0.5 * (row.angular_b + end[r].angular_b);
    row.target_m_s = 0.0;
  }
  return middle;
}

JointKicks find_kicks(const JointedStep& step, const JointedSolution& solved,
                      const JointSystem& middle) {
  constexpr double kLonger = 2.0;
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  const std::span<const JointRow> end = solved.joints.rows;
  JointKicks kicks{{}, middle};
  const std::vector<bool> held = held_bodies(solved);
  const bool all = std::ranges::find(held, false) == held.end();
  if (all || is_isolated(ids.size(), solved.joints, &solved.problem)) return kicks;
  const std::vector<SolverBody> given = given_velocities(step, solved, held);
  kicks.bodies.resize(given.size());
  const double longer_s = kLonger * kLonger * dt_s;
  hold_rows(held, end, kicks.joints.rows);
  if (are_even(scene, ids))
    add_stiffness_rows(scene, longer_s, step.states, solved.joints, kicks.bodies, kicks.joints);
  stiffen(scene, longer_s, step.states, solved.joints, std::span(given).first(ids.size()),
          kicks.bodies);
  stop_joint_velocities(kicks.bodies, kicks.joints);
  drop_stiffness_rows(kicks.joints);
  for (std::size_t i = 0; i < given.size(); ++i)
    if (!held[i]) kicks.lift_joule += 0.5 * work_of(given[i], kicks.bodies[i]);
  return kicks;
}

void move_by_mean(const JointedStep& step, const JointedSolution& solved, const JointKicks& kicks,
                  double most_joule, std::span<BodyState> states) {
  constexpr double kRoundings = 100.0;  // the next step closes a few
  if (!(most_joule > 0.0)) return;
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  JointSystem before = solved.joints;
  build_joint_errors(scene, states, before);
  const double share =
      std::min(share_before_touch(0.5 * dt_s, step, solved.problem, before.rows, kicks.bodies),
               most_joule / kicks.lift_joule);
  const std::vector<BodyState> whole(states.begin(), states.end());
  const double back_s = -0.5 * share * dt_s;
  for (std::size_t i = 0; i < states.size(); ++i) {
    states[i].position_m += back_s * kicks.bodies[i].linear;
    rotate_by(scene.bodies[index_of(ids[i])], back_s * kicks.bodies[i].angular, states[i]);
  }
  const double rounding_m = kRoundings * rounding_of(whole, before.reach_m);
  if (!rejoin(step, kicks, before.rows, rounding_m, states))
    std::copy(whole.begin(), whole.end(), states.begin());
}

}  // namespace soda::physics
