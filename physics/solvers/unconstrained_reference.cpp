#include "physics/solvers/unconstrained_reference.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/constraints/limits_and_motors.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

double mixed(double share, double from, double to) { return from + (to - from) * share; }

// A kinematic body's size is not known here: where it turns, it may throw as fast as it likes.
double gyration_m(const SolverBody& body) {
  constexpr double kAny = 1e6;
  if (body.inverse_mass == 0.0) return kAny;
  return std::sqrt(body.inverse_mass / body.inverse_inertia.norm());
}

double speed_m_s(const SolverBody& body) {
  return body.linear.norm() + gyration_m(body) * body.angular.norm();
}

// Before the step and after external forces, or faster.
std::vector<double> speeds_before(std::span<const BodyState> before,
                                  std::span<const SolverBody> free) {
  std::vector<double> speeds;
  for (std::size_t i = 0; i < free.size(); ++i)
    speeds.push_back(std::max(speed_m_s(free[i]),
                              before[i].linear_velocity_m_s.norm() +
                                  gyration_m(free[i]) * before[i].angular_velocity_rad_s.norm()));
  return speeds;
}

// After joints, motors and springs; contacts have no impulse.
std::vector<SolverBody> unhindered(std::span<const SolverBody> free, JointSystem joints,
                                   const ContactProblem& problem) {
  std::vector<SolverBody> bodies = problem.bodies;
  std::copy(free.begin(), free.end(), bodies.begin());
  for (JointRow& row : joints.rows) row.impulse_newton_s = 0.0;
  rest_bounds(joints);
  factor_joint_rows(bodies, joints);
  solve_bounded(bodies, 0.0, joints);
  return bodies;
}

// What contacts may make of each body.
std::vector<double> most_speeds(std::span<const SolverBody> free,
                                const std::vector<double>& speeds) {
  constexpr double kMostOfOthers = 30.0, kMostOfOwn = 3.0;
  std::vector<double> most;
  for (std::size_t i = 0; i < free.size(); ++i) {
    most.push_back(kMostOfOwn * speeds[i]);
    for (std::size_t k = 0; k < free.size(); ++k)
      if (k != i && free[k].inverse_mass <= free[i].inverse_mass)
        most[i] = std::max(most[i], kMostOfOthers * speeds[k]);
  }
  return most;
}

bool is_thrown(const ContactProblem& problem, const std::vector<double>& most) {
  for (std::size_t i = 0; i < most.size(); ++i)
    if (speed_m_s(problem.bodies[i]) > most[i]) return true;
  return false;
}

// The largest share of `to` in a mixture of the two with a body within the speed.
double share_within(double most_m_s, const SolverBody& from, const SolverBody& to) {
  const double now = speed_m_s(to), reference = speed_m_s(from);
  if (now <= most_m_s) return 1.0;
  return reference < most_m_s ? (most_m_s - reference) / (now - reference) : 0.0;
}

}  // namespace

bool is_out_of_bounds(const ContactProblem& problem) {
  const auto within = [](const Vec3& v, double most) { return v.squaredNorm() <= most * most; };
  return !std::all_of(problem.bodies.begin(), problem.bodies.end(), [&](const SolverBody& body) {
    return within(body.linear, kLargestSpeed_m_s) &&
           within(body.angular, kLargestAngularSpeed_rad_s);
  });
}

void solve_unconstrained_reference(std::span<const SolverBody> free, JointSystem& joints,
                                   ContactProblem& problem) {
  std::copy(free.begin(), free.end(), problem.bodies.begin());
  problem.bodies[free.size()] = {};  // not what an endless impulse has made of the statics' rest
  forget_impulses(problem);
  for (JointRow& row : joints.rows) {
    row.impulse_newton_s = 0.0;
    if (row.kind == JointRowKind::kHolds) row.target_m_s = 0.0;
    if (row.kind == JointRowKind::kLimit) row.target_m_s = std::min(0.0, row.target_m_s);
    row.idle = row.kind == JointRowKind::kMotor || row.kind == JointRowKind::kLimit;
  }
  stop_joint_velocities(problem.bodies, joints);
  if (!is_out_of_bounds(problem)) return;
  for (JointRow& row : joints.rows) row.impulse_newton_s = 0.0;
  std::copy(free.begin(), free.end(), problem.bodies.begin());
}

void take_contact_impulses(const ContactProblem& from, ContactProblem& problem) {
  const auto push = [&problem](std::uint32_t a, std::uint32_t b, const Vec3& impulse,
                               const Vec3& angular_a, const Vec3& angular_b) {
    SolverBody &x = problem.bodies[a], &y = problem.bodies[b];
    x.linear -= impulse * x.inverse_mass;
    x.angular -= x.inverse_inertia * angular_a;
    y.linear += impulse * y.inverse_mass;
    y.angular += y.inverse_inertia * angular_b;
  };
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    NormalRow& row = problem.normals[i];
    const double change = from.normals[i].impulse_newton_s - row.impulse_newton_s;
    push(row.a, row.b, row.normal * change, row.arm_a * change, row.arm_b * change);
    row.impulse_newton_s = from.normals[i].impulse_newton_s;
  }
  for (std::size_t i = 0; i < problem.frictions.size(); ++i) {
    FrictionRow& row = problem.frictions[i];
    Vec3 change = Vec3::Zero();
    for (int t = 0; t < 2; ++t) {
      change += row.tangent[t] * (from.frictions[i].impulse_newton_s[t] - row.impulse_newton_s[t]);
      row.impulse_newton_s[t] = from.frictions[i].impulse_newton_s[t];
    }
    push(row.a, row.b, change, row.arm_a.cross(change), row.arm_b.cross(change));
  }
  for (std::size_t i = 0; i < problem.rollings.size(); ++i) {
    RollingRow& row = problem.rollings[i];
    const Vec3& impulse = from.rollings[i].impulse_newton_m_s;
    apply_rolling_impulse(row, impulse - row.impulse_newton_m_s, problem);
    row.impulse_newton_m_s = impulse;
  }
}

void mix(double share, const JointSystem& from_joints, const ContactProblem& from,
         JointSystem& joints, ContactProblem& problem) {
  for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
    SolverBody& body = problem.bodies[i];
    const SolverBody& start = from.bodies[i];
    body.linear = start.linear + (body.linear - start.linear) * share;
    body.angular = start.angular + (body.angular - start.angular) * share;
  }
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    double& impulse = problem.normals[i].impulse_newton_s;
    impulse = mixed(share, from.normals[i].impulse_newton_s, impulse);
  }
  for (std::size_t i = 0; i < problem.frictions.size(); ++i)
    for (int t = 0; t < 2; ++t) {
      double& impulse = problem.frictions[i].impulse_newton_s[t];
      impulse = mixed(share, from.frictions[i].impulse_newton_s[t], impulse);
    }
  if (!problem.rollings.empty()) mix_rolling(share, from.rollings, problem);
  for (std::size_t i = 0; i < joints.rows.size(); ++i) {
    double& impulse = joints.rows[i].impulse_newton_s;
    impulse = mixed(share, from_joints.rows[i].impulse_newton_s, impulse);
  }
}

bool limit_throws(std::span<const BodyState> before, std::span<const SolverBody> free,
                  JointSystem& joints, ContactProblem& problem) {
  if (problem.normals.empty()) return false;
  std::vector<double> speeds = speeds_before(before, free);
  if (!is_thrown(problem, most_speeds(free, speeds))) return false;
  const std::vector<SolverBody> driven = unhindered(free, joints, problem);
  for (std::size_t i = 0; i < free.size(); ++i)
    speeds[i] = std::max(speeds[i], speed_m_s(driven[i]));
  const std::vector<double> most = most_speeds(free, speeds);
  if (!is_thrown(problem, most)) return false;
  JointSystem reference_joints = joints;
  ContactProblem reference = problem;
  solve_unconstrained_reference(free, reference_joints, reference);
  double share = 1.0;
  for (std::size_t i = 0; i < free.size(); ++i)
    share = std::min(share, share_within(most[i], reference.bodies[i], problem.bodies[i]));
  mix(share, reference_joints, reference, joints, problem);
  return true;
}

}  // namespace soda::physics
