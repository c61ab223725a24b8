#include "physics/solvers/swept_joints.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/joint_anchor.hpp"
#include "physics/constraints/limits_and_motors.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/softness.hpp"

namespace soda::physics {
namespace {

// Of what is open, in a substep of a whole step. In a shorter one it has less time.
constexpr double kDampingOfJoints = 5.0;

// At once: the share of the error that goes in a substep of a whole step; and of a row's own
// response, what it gives way, for joints can contradict each other.
constexpr double kClosedAtOnce = 0.5, kGiveAtOnce = 1e-9;

// Chains and trees.
bool is_narrow(JointSystem& joints) {
  constexpr double kOfRow = 200.0;  // multiplications
  const double most = kOfRow * joints.first_row.back();
  return factor_multiplications(most, joints) <= most;
}

bool has_point(JointKind kind) {
  return kind == JointKind::kBall || kind == JointKind::kHinge || kind == JointKind::kFixed;
}

// The columns of the response of a point on a body to an impulse there.
void add_response(const SolverBody& body, const Vec3& arm, Mat3& response) {
  if (!(body.inverse_mass > 0.0)) return;
  for (int i = 0; i < 3; ++i) {
    const Vec3 axis = Vec3::Unit(i);
    response.col(i) +=
        axis * body.inverse_mass + times(body.inverse_inertia, arm.cross(axis)).cross(arm);
  }
}

void give(const SweptPoint& point, const Vec3& impulse, std::span<SolverBody> bodies) {
  SolverBody &a = bodies[point.a], &b = bodies[point.b];
  a.linear -= impulse * a.inverse_mass;
  a.angular -= times(a.inverse_inertia, point.arm_a.cross(impulse));
  b.linear += impulse * b.inverse_mass;
  b.angular += times(b.inverse_inertia, point.arm_b.cross(impulse));
}

Vec3 velocity_of(const SweptPoint& point, std::span<const SolverBody> bodies) {
  const SolverBody &a = bodies[point.a], &b = bodies[point.b];
  return b.linear + b.angular.cross(point.arm_b) - a.linear - a.angular.cross(point.arm_a);
}

void give(const SweptRow& swept, const JointRow& row, double impulse,
          std::span<SolverBody> bodies) {
  SolverBody &a = bodies[row.a], &b = bodies[row.b];
  a.linear -= row.linear * (a.inverse_mass * impulse);
  a.angular -= swept.twist_a * impulse;
  b.linear += row.linear * (b.inverse_mass * impulse);
  b.angular += swept.twist_b * impulse;
}

void solve_point(const Softness& closing, double per_second, SweptPoint& point,
                 std::span<SolverBody> bodies) {
  const Vec3 wanted = -(point.error_m * (closing.rate * per_second) + velocity_of(point, bodies));
  const Vec3 change = times(point.mass_kg, wanted) * closing.mass_share -
                      point.impulse_newton_s * closing.impulse_share;
  point.impulse_newton_s += change;
  give(point, change, bodies);
}

// The velocity that a row has to get.
double target_m_s(const JointRow& row, const Softness& closing, double per_second) {
  switch (row.kind) {
    case JointRowKind::kHolds:
      return -row.error * (closing.rate * per_second);
    case JointRowKind::kLimit:
      return -row.error * (row.error > 0.0 ? per_second : closing.rate * per_second);
    case JointRowKind::kSpring:
    case JointRowKind::kMotor:
    case JointRowKind::kStiffness:
      break;
  }
  return row.target_m_s;
}

void solve_row(const Softness& closing, double per_second, const SweptRow& swept, JointRow& row,
               std::span<SolverBody> bodies) {
  const bool soft =
      row.kind == JointRowKind::kHolds || (row.kind == JointRowKind::kLimit && row.error <= 0.0);
  const double lacks = target_m_s(row, closing, per_second) - velocity_of(row, bodies) -
                       row.softness_1_kg * row.impulse_newton_s;
  double impulse = row.impulse_newton_s + lacks * swept.mass_kg * (soft ? closing.mass_share : 1.0);
  if (soft) impulse -= row.impulse_newton_s * closing.impulse_share;
  if (is_bounded(row)) impulse = std::clamp(impulse, row.least_newton_s, row.most_newton_s);
  const double change = impulse - row.impulse_newton_s;
  row.impulse_newton_s = impulse;
  give(swept, row, change, bodies);
}

void iterate(bool forward, const Softness& closing, SweptJoints& joints,
             std::span<SolverBody> bodies) {
  const double per_second = 1.0 / joints.length_s;
  const auto in_turn = [forward](std::size_t count, const auto& visit) {
    for (std::size_t k = 0; k < count; ++k) visit(forward ? k : count - 1 - k);
  };
  in_turn(joints.rows.size(), [&](std::size_t i) {
    const SweptRow& swept = joints.rows[i];
    solve_row(closing, per_second, swept, joints.rest.rows[swept.row], bodies);
  });
  in_turn(joints.points.size(),
          [&](std::size_t i) { solve_point(closing, per_second, joints.points[i], bodies); });
}

void follow(const Joint& joint, std::span<const BodyState> poses,
            std::span<const SolverBody> bodies, SweptPoint& point) {
  const JointAnchor a = anchor_of(poses, point.a, joint.anchor_a_m);
  const JointAnchor b = anchor_of(poses, point.b, joint.anchor_b_m);
  point.arm_a = a.arm;
  point.arm_b = b.arm;
  point.error_m = b.place_m - a.place_m;
  Mat3 response = Mat3::Zero();
  add_response(bodies[point.a], point.arm_a, response);
  add_response(bodies[point.b], point.arm_b, response);
  point.mass_kg = response.trace() > 0.0 ? inverse_of_symmetric(response) : Mat3(Mat3::Zero());
}

void follow(const JointRow& row, std::span<const SolverBody> bodies, SweptRow& swept) {
  const SolverBody &a = bodies[row.a], &b = bodies[row.b];
  swept.twist_a = times(a.inverse_inertia, row.angular_a);
  swept.twist_b = times(b.inverse_inertia, row.angular_b);
  const double response = (a.inverse_mass + b.inverse_mass) * row.linear.squaredNorm() +
                          row.angular_a.dot(swept.twist_a) + row.angular_b.dot(swept.twist_b) +
                          row.softness_1_kg;
  swept.mass_kg = response > 0.0 ? 1.0 / response : 0.0;
}

// Rows at the poses, with the impulses that they had.
void build_rest(SweptJoints& joints) {
  const std::vector<JointRow> before = std::move(joints.rest.rows);
  build_joint_rows(joints.scene, joints.length_s, joints.poses, true, joints.rest);
  bound_step(joints.length_s, joints.rest);
  for (JointRow& row : joints.rest.rows) row.idle = is_bounded(row);
  for (std::size_t r = 0; r < before.size(); ++r) {
    JointRow& row = joints.rest.rows[r];
    row.impulse_newton_s = before[r].impulse_newton_s;
    if (is_bounded(row))
      row.impulse_newton_s =
          std::clamp(row.impulse_newton_s, row.least_newton_s, row.most_newton_s);
    if (joints.at_once) row.idle = before[r].idle;
  }
}

void hold_at_once(double closed, SweptJoints& joints, std::span<SolverBody> bodies) {
  for (JointRow& row : joints.rest.rows)
    if (row.kind == JointRowKind::kHolds || (row.kind == JointRowKind::kLimit && row.error < 0.0))
      row.target_m_s = -row.error * closed / joints.length_s;
  solve_bounded(bodies, kGiveAtOnce, joints.rest);
}

void solve(bool forward, bool closes, SweptJoints& joints, std::span<SolverBody> bodies) {
  iterate(forward,
          closes ? spring_of(kPhaseOfSubstep * joints.part_of_step, kDampingOfJoints) : Softness{},
          joints, bodies);
  if (joints.at_once)
    hold_at_once(closes ? kClosedAtOnce * joints.part_of_step : 0.0, joints, bodies);
}

void add_point(const JointSystem& joints, std::uint32_t place, SweptJoints& swept) {
  SweptPoint& point = swept.points.emplace_back();
  point.a = joints.bodies[place][0];
  point.b = joints.bodies[place][1];
  point.joint = joints.joints[place];
  point.first_row = joints.first_row[place];
}

// Which rows are solved how.
void divide(const JointSystem& joints, SweptJoints& swept) {
  std::uint32_t row = 0;
  for (std::uint32_t j = 0; j < joints.joints.size(); ++j) {
    const JointKind kind = swept.scene.joints[joints.joints[j]].kind;
    const bool point = !swept.at_once && has_point(kind);
    if (point) add_point(joints, j, swept);
    if (point && kind == JointKind::kBall) continue;
    swept.rest.joints.push_back(joints.joints[j]);
    swept.rest.bodies.push_back(joints.bodies[j]);
    swept.rest.ends.push_back(joints.ends[j]);
    const std::uint32_t first = joints.first_row[j];
    for (std::uint32_t r = first; r < joints.first_row[j + 1]; ++r, ++row) {
      if (point && r < first + 3) continue;
      swept.rest_rows.push_back({row, r});
      if (!swept.at_once) swept.rows.push_back({row});
    }
  }
  swept.rest.bounded = joints.bounded;
  swept.rest.lever_m = joints.lever_m;
  if (swept.at_once) swept.rest.elimination = joints.elimination;
}

}  // namespace

SweptJoints swept_joints(const SceneDescription& scene, double length_s, std::uint32_t count,
                         std::span<const BodyState> states, JointSystem& joints) {
  SweptJoints swept{
      scene, length_s, count * length_s / scene.dt_s, is_narrow(joints), {}, {}, {}, {}, {},
      {},    {}};
  for (const BodyState& state : states) swept.poses.push_back(motion_of(state));
  swept.sum_newton_s.assign(joints.rows.size(), 0.0);
  divide(joints, swept);
  build_rest(swept);
  const double share = 1.0 / count;
  for (SweptPoint& point : swept.points)
    for (int i = 0; i < 3; ++i)
      point.impulse_newton_s[i] = joints.rows[point.first_row + i].impulse_newton_s * share;
  for (const RestRow& of : swept.rest_rows)
    swept.rest.rows[of.row].impulse_newton_s = joints.rows[of.of_system].impulse_newton_s * share;
  return swept;
}

void follow_poses(bool first, SweptJoints& joints, std::span<SolverBody> bodies) {
  joints.counted_newton_s.assign(joints.sum_newton_s.size(), 0.0);
  if (!first) {
    for (const SweptPoint& point : joints.points) give(point, -point.impulse_newton_s, bodies);
    take_back_joint_impulses(joints.rest, bodies);
    build_rest(joints);
  }
  for (SweptPoint& point : joints.points) {
    follow(joints.scene.joints[point.joint], joints.poses, bodies, point);
    give(point, point.impulse_newton_s, bodies);
  }
  for (const RestRow& of : joints.rest_rows) {
    const JointRow& row = joints.rest.rows[of.row];
    apply_joint_impulse(row, row.impulse_newton_s, bodies);
  }
  for (SweptRow& row : joints.rows) follow(joints.rest.rows[row.row], bodies, row);
  if (joints.at_once) factor_joint_rows(bodies, joints.rest, kGiveAtOnce);
}

void press(SweptJoints& joints, std::span<SolverBody> bodies) { solve(true, true, joints, bodies); }

void relax(SweptJoints& joints, std::span<SolverBody> bodies) {
  solve(false, false, joints, bodies);
}

void move_on(std::span<const SolverBody> bodies, SweptJoints& joints) {
  for (std::size_t i = 0; i < joints.poses.size(); ++i) {
    joints.poses[i].position_m += bodies[i].linear * joints.length_s;
    joints.poses[i].orientation =
        turned(bodies[i].angular * joints.length_s, joints.poses[i].orientation);
  }
  for (const SweptRow& row : joints.rows) {
    JointRow& of = joints.rest.rows[row.row];
    if (of.kind == JointRowKind::kLimit) of.error += velocity_of(of, bodies) * joints.length_s;
  }
}

void count_impulses(std::span<const SolverBody> bodies, SweptJoints& joints) {
  const auto new_of = [&joints](std::uint32_t row, double impulse) {
    const double change = impulse - std::exchange(joints.counted_newton_s[row], impulse);
    joints.sum_newton_s[row] += change;
    return change;
  };
  const auto given = [&joints](std::uint32_t a, std::uint32_t b, const Vec3& impulse,
                               const Vec3& angular) {
    if (b != joints.poses.size()) return;
    joints.by_world_newton_s -= impulse;
    joints.by_world_newton_m_s -= angular + joints.poses[a].position_m.cross(impulse);
  };
  for (const SweptPoint& point : joints.points) {
    Vec3 impulse;
    for (int i = 0; i < 3; ++i) impulse[i] = new_of(point.first_row + i, point.impulse_newton_s[i]);
    given(point.a, point.b, impulse, point.arm_a.cross(impulse));
  }
  for (const RestRow& of : joints.rest_rows) {
    const JointRow& row = joints.rest.rows[of.row];
    const double impulse = new_of(of.of_system, row.impulse_newton_s);
    given(row.a, row.b, row.linear * impulse, row.angular_a * impulse);
    if (row.kind == JointRowKind::kMotor)
      joints.motor_work_joule += impulse * velocity_of(row, bodies);
  }
}

void end_substeps(const SweptJoints& swept, JointSystem& joints) {
  build_joint_rows(swept.scene, swept.length_s, swept.poses, true, joints);
  for (std::size_t r = 0; r < joints.rows.size(); ++r)
    joints.rows[r].impulse_newton_s = swept.sum_newton_s[r];
}

double residual_m_s(const SweptJoints& joints, std::span<const SolverBody> bodies) {
  double largest = 0.0;
  for (const SweptPoint& point : joints.points)
    if (point.mass_kg != Mat3::Zero())
      largest = std::max(largest, velocity_of(point, bodies).norm());
  for (const RestRow& of : joints.rest_rows) {
    const JointRow& row = joints.rest.rows[of.row];
    const bool moves = bodies[row.a].inverse_mass + bodies[row.b].inverse_mass > 0.0;
    if (row.kind == JointRowKind::kHolds && moves)
      largest = std::max(largest, std::abs(velocity_of(row, bodies)));
  }
  return largest;
}

}  // namespace soda::physics
