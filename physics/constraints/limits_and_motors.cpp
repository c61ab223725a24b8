#include "physics/constraints/limits_and_motors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace soda::physics {
namespace {

constexpr double kAnyPush = std::numeric_limits<double>::infinity();

// The speed at which a motor wants to go on for a part of a step. What a servo has left falls by
// the trapezoidal rule, or at once where that would pass the target.
double wanted_speed(double part_s, const JointRow& row) {
  const JointMotor& motor = *row.motor;
  if (!motor.target) return motor.speed;
  const double half_s = 0.5 * part_s, most = std::abs(motor.speed);
  return std::clamp(row.left / (std::max(motor.time_constant_s, half_s) + half_s), -most, most);
}

// For `time_s` of the part.
void let_push(double time_s, double part_s, JointRow& row) {
  row.most_newton_s = row.motor->most_push / row.lever_m * time_s;
  row.least_newton_s = -row.most_newton_s;
  row.idle = !(row.motor->most_push > 0.0);
  row.target_m_s = row.lever_m * wanted_speed(part_s, row);
}

// The largest velocities that those of the rows are made of: what rounding is measured by. Of the
// whole system, for impulses carry rounding from what moves to what rests.
double scale_m_s(const JointSystem& system, std::span<const SolverBody> bodies) {
  double largest = 0.0;
  for (const JointRow& row : system.rows) {
    const SolverBody& a = bodies[row.a];
    const SolverBody& b = bodies[row.b];
    largest = std::max(largest, std::abs(row.target_m_s) + a.linear.norm() + b.linear.norm() +
                                    row.angular_a.norm() * a.angular.norm() +
                                    row.angular_b.norm() * b.angular.norm());
  }
  return largest;
}

// Of that scale: what rounding can leave, and what a solution can that found the row to depend on
// others, as that of a motor that drives against a stop.
constexpr double kBoundRounding = 1e-13, kUnsolved = 1e-6;

// What the row's velocity lacks of its target, as far as an impulse within its bounds can help.
double missing_m_s(const JointRow& row, double slack_m_s, std::span<const SolverBody> bodies) {
  const double missing = row.target_m_s - velocity_of(row, bodies);
  if (std::abs(missing) <= slack_m_s) return 0.0;
  const double bound = missing > 0.0 ? row.most_newton_s : row.least_newton_s;
  return row.impulse_newton_s == bound ? 0.0 : missing;
}

void rest_at(double impulse, JointRow& row, std::span<SolverBody> bodies) {
  apply_joint_impulse(row, impulse - row.impulse_newton_s, bodies);
  row.impulse_newton_s = impulse;
  row.idle = true;
}

// From impulses within their bounds to the solution of the rows that take part, or as far as the
// first of their bounds, where that row goes to rest. Whether the solution was reached.
bool approach(JointSystem& system, std::span<SolverBody> bodies, std::vector<double>& before) {
  before.clear();
  for (const JointRow& row : system.rows) before.push_back(row.impulse_newton_s);
  solve_joint_velocities(system, bodies);
  double share = 1.0, bound = 0.0;
  JointRow* first = nullptr;
  for (std::size_t r = 0; r < before.size(); ++r) {
    JointRow& row = system.rows[r];
    if (!is_bounded(row) || row.idle) continue;
    const double now = row.impulse_newton_s;
    const double kept = std::clamp(now, row.least_newton_s, row.most_newton_s);
    if (kept == now) continue;
    const double part = (kept - before[r]) / (now - before[r]);
    if (first != nullptr && !(part < share)) continue;
    share = part;
    bound = kept;
    first = &row;
  }
  if (first == nullptr) return true;
  for (std::size_t r = 0; r < before.size(); ++r) {
    JointRow& row = system.rows[r];
    const double back = (1.0 - share) * (before[r] - row.impulse_newton_s);
    apply_joint_impulse(row, back, bodies);
    row.impulse_newton_s += back;
  }
  rest_at(bound, *first, bodies);
  return false;
}

// What becomes of a row once the rows that take part are solved. A row that has a part in it but no
// effect goes to its bound.
struct Change {
  double missing_m_s = 0.0;  // 0: none
  double bound_newton_s = 0.0;
};
Change change_of(const JointRow& row, double scale_m_s, std::span<const SolverBody> bodies) {
  if (!is_bounded(row)) return {};
  const double slack = (row.idle ? kBoundRounding : kUnsolved) * scale_m_s;
  const double missing = missing_m_s(row, slack, bodies);
  const double bound = missing > 0.0 ? row.most_newton_s : row.least_newton_s;
  if (!row.idle && !std::isfinite(bound)) return {};
  return {missing, bound};
}

// Of a solution within bounds: the first row without effect goes to its bound; else the row that
// lacks most begins to take part. Whether there was any.
bool change_one(double scale_m_s, JointSystem& system, std::span<SolverBody> bodies) {
  JointRow* worst = nullptr;
  double most = 0.0;
  for (JointRow& row : system.rows) {
    const Change change = change_of(row, scale_m_s, bodies);
    if (change.missing_m_s == 0.0) continue;
    if (!row.idle) {
      rest_at(change.bound_newton_s, row, bodies);
      return true;
    }
    if (!(std::abs(change.missing_m_s) > most)) continue;
    most = std::abs(change.missing_m_s);
    worst = &row;
  }
  if (worst != nullptr) worst->idle = false;
  return worst != nullptr;
}

// The same of all rows at once, and those beyond a bound go back to it. How many there were.
std::size_t change_all(double scale_m_s, JointSystem& system, std::span<SolverBody> bodies) {
  struct Exchange {
    JointRow* row;
    double bound;
  };
  std::vector<Exchange> found;
  for (JointRow& row : system.rows) {
    if (!is_bounded(row)) continue;
    const double kept = std::clamp(row.impulse_newton_s, row.least_newton_s, row.most_newton_s);
    if (!row.idle && kept != row.impulse_newton_s) {
      found.push_back({&row, kept});
      continue;
    }
    const Change change = change_of(row, scale_m_s, bodies);
    if (change.missing_m_s != 0.0) found.push_back({&row, change.bound_newton_s});
  }
  for (const Exchange& exchange : found) {
    if (exchange.row->idle)
      exchange.row->idle = false;
    else
      rest_at(exchange.bound, *exchange.row, bodies);
  }
  return found.size();
}

// As long as ever fewer rows change. Whether that leads to the solution; impulses are within their
// bounds. J. J. Judice, F. M. Pires, "A block principal pivoting algorithm for large-scale strictly
// monotone linear complementarity problems", Computers & Operations Research 21 (1994).
bool solve_by_exchanges(double scale_m_s, double regularisation, JointSystem& system,
                        std::span<SolverBody> bodies) {
  constexpr int kMostInVain = 3;
  std::size_t fewest = system.rows.size() + 1;
  for (int in_vain = 0; in_vain <= kMostInVain;) {
    solve_joint_velocities(system, bodies);
    const std::size_t changed = change_all(scale_m_s, system, bodies);
    if (changed == 0) return true;
    if (changed < fewest) {
      fewest = changed;
      in_vain = 0;
    } else {
      ++in_vain;
    }
    factor_joint_rows(bodies, system, regularisation);
  }
  return false;
}

}  // namespace

void bound_velocities(double time_s, double reached_m, JointSystem& system) {
  if (!system.bounded) return;
  for (JointRow& row : system.rows) {
    if (row.kind == JointRowKind::kMotor) let_push(time_s, 2.0 * time_s, row);
    if (row.kind != JointRowKind::kLimit) continue;
    row.most_newton_s = row.error <= reached_m ? kAnyPush : 0.0;
    row.target_m_s = 0.0;
  }
}

void bound_step(double time_s, JointSystem& system) {
  if (!system.bounded) return;
  for (JointRow& row : system.rows) {
    if (row.kind == JointRowKind::kMotor) let_push(time_s, time_s, row);
    if (row.kind != JointRowKind::kLimit) continue;
    row.most_newton_s = kAnyPush;
    row.target_m_s = -std::max(row.error, 0.0) / time_s;
  }
}

void rest_bounds(JointSystem& system) {
  for (JointRow& row : system.rows) row.idle = is_bounded(row);
}

bool hold_passed_limits(double passed_m, JointSystem& system) {
  if (!system.bounded) return false;
  bool more = false;
  for (JointRow& row : system.rows) {
    if (row.kind == JointRowKind::kMotor) row.idle = true;
    if (row.kind != JointRowKind::kLimit || !row.idle || !(row.error < -passed_m)) continue;
    row.idle = false;
    more = true;
  }
  return more;
}

void hold_same_limits(const JointSystem& from, JointSystem& system) {
  if (!system.bounded) return;
  for (std::size_t r = 0; r < system.rows.size(); ++r) system.rows[r].idle = from.rows[r].idle;
}

// Least squares with bounds. Where exchanges of many rows get nowhere, of one after the other
// (Lawson and Hanson's way): every change brings the impulses nearer to the solution and leaves
// them within their bounds, so it ends, and where the number of changes runs out nothing pushes
// more than it may.
void solve_bounded(std::span<SolverBody> bodies, double regularisation, JointSystem& system) {
  if (!system.bounded) return solve_joint_velocities(system, bodies);
  const double scale = scale_m_s(system, bodies);
  if (solve_by_exchanges(scale, regularisation, system, bodies)) return;
  const std::size_t most = 50 + 4 * system.rows.size();
  std::vector<double> before;
  for (std::size_t i = 0; i < most; ++i) {
    const bool solved = approach(system, bodies, before);
    if (solved && !change_one(scale, system, bodies)) return;
    factor_joint_rows(bodies, system, regularisation);
  }
}

}  // namespace soda::physics
