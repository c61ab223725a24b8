#include "physics/joint_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace soda::physics {
namespace {

constexpr double kAnyPush = std::numeric_limits<double>::infinity();

void let_push(double time_s, JointRow& row) {
  row.least_newton_s = -row.most_push * time_s;
  row.most_newton_s = row.most_push * time_s;
  row.idle = !(row.most_push > 0.0);
}

bool is_bounded(const JointRow& row) {
  return row.kind == JointRowKind::kLimit || row.kind == JointRowKind::kMotor;
}

// The velocities that the row's is made of: what rounding is measured by.
double scale_m_s(const JointRow& row, std::span<const SolverBody> bodies) {
  const SolverBody& a = bodies[row.a];
  const SolverBody& b = bodies[row.b];
  return (std::abs(row.target_m_s) + a.linear.norm() + b.linear.norm() +
          row.turn_a.norm() * a.angular.norm() + row.turn_b.norm() * b.angular.norm());
}

// Of that scale: what rounding can leave, and what a solution can that found the row to depend on
// others, as that of a motor that drives against a stop.
constexpr double kRounding = 1e-13, kUnsolved = 1e-6;

// Whether a row that takes part pushes more than it may or cannot reach its target, or one that
// does not take part should.
bool is_wrong(const JointRow& row, std::span<const SolverBody> bodies) {
  if (!is_bounded(row) || row.least_newton_s == row.most_newton_s) return false;
  const double impulse = row.impulse_newton_s;
  if (!row.idle && (impulse < row.least_newton_s || impulse > row.most_newton_s)) return true;
  const double missing = row.target_m_s - velocity_of(row, bodies);
  const double slack = (row.idle ? kRounding : kUnsolved) * scale_m_s(row, bodies);
  if (std::abs(missing) <= slack) return false;
  const double bound = missing > 0.0 ? row.most_newton_s : row.least_newton_s;
  return impulse != bound && (row.idle || std::isfinite(bound));
}

// What it goes to when it ceases to take part.
double bound_of(const JointRow& row, std::span<const SolverBody> bodies) {
  const double impulse = row.impulse_newton_s;
  if (impulse < row.least_newton_s) return row.least_newton_s;
  if (impulse > row.most_newton_s) return row.most_newton_s;
  return velocity_of(row, bodies) < row.target_m_s ? row.most_newton_s : row.least_newton_s;
}

void change(JointRow& row, std::span<SolverBody> bodies) {
  row.idle = !row.idle;
  if (!row.idle) return;
  const double kept = bound_of(row, bodies);
  apply_joint_impulse(row, kept - row.impulse_newton_s, bodies);
  row.impulse_newton_s = kept;
}

}  // namespace

void bound_velocities(double time_s, double reached, JointSystem& system) {
  if (!system.bounded) return;
  for (JointRow& row : system.rows) {
    if (row.kind == JointRowKind::kMotor) let_push(time_s, row);
    if (row.kind != JointRowKind::kLimit) continue;
    row.most_newton_s = row.error <= reached ? kAnyPush : 0.0;
    row.target_m_s = 0.0;
  }
}

void bound_step(double time_s, JointSystem& system) {
  if (!system.bounded) return;
  for (JointRow& row : system.rows) {
    if (row.kind == JointRowKind::kMotor) let_push(time_s, row);
    if (row.kind != JointRowKind::kLimit) continue;
    row.most_newton_s = kAnyPush;
    row.target_m_s = -std::max(row.error, 0.0) / time_s;
  }
}

void rest_bounds(JointSystem& system) {
  for (JointRow& row : system.rows) row.idle = is_bounded(row);
}

bool hold_passed_limits(double passed, JointSystem& system) {
  if (!system.bounded) return false;
  bool more = false;
  for (JointRow& row : system.rows) {
    if (row.kind == JointRowKind::kMotor) row.idle = true;
    if (row.kind != JointRowKind::kLimit || !row.idle || !(row.error < -passed)) continue;
    row.idle = false;
    more = true;
  }
  return more;
}

void hold_same_limits(const JointSystem& from, JointSystem& system) {
  if (!system.bounded) return;
  for (std::size_t r = 0; r < system.rows.size(); ++r) system.rows[r].idle = from.rows[r].idle;
}

// Guess which bounds are reached, solve for the rest, and look where the guess was wrong. All wrong
// guesses change at once for as long as that leads somewhere; then the first only, which cannot
// come back to a guess that was wrong before (Murty) but for rounding.
void solve_bounded(std::size_t body_count, std::span<SolverBody> bodies, double regularisation,
                   JointSystem& system) {
  solve_joint_velocities(system, bodies);
  if (!system.bounded) return;
  constexpr std::size_t kAtOnce = 8;
  const std::size_t most = kAtOnce + 8 * system.rows.size();
  for (std::size_t i = 0; i < most; ++i) {
    bool changed = false;
    for (JointRow& row : system.rows) {
      if (!is_wrong(row, bodies)) continue;
      change(row, bodies);
      changed = true;
      if (i >= kAtOnce) break;
    }
    if (!changed) return;
    factor_joint_rows(body_count, bodies, system, regularisation);
    solve_joint_velocities(system, bodies);
  }
}

}  // namespace soda::physics
