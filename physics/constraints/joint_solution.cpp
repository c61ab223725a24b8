// The direct solution of joint rows.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "physics/constraints/joint_assembly.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/constraints/limits_and_motors.hpp"
#include "physics/math/solver_body.hpp"

namespace soda::physics {
namespace {

bool is_to_be_closed(const JointRow& row) {
  const bool open = row.kind == JointRowKind::kLimit && row.idle && row.error > 0.0;
  return !(row.softness_1_kg > 0.0) && !open;
}

}  // namespace

double factor_multiplications(double most, JointSystem& system) {
  if (!system.elimination) {
    std::optional<JointElimination> plan =
        plan_joint_elimination(system.ends, system.first_row, most);
    if (!plan) return std::numeric_limits<double>::infinity();
    system.elimination = std::make_shared<const JointElimination>(*std::move(plan));
  }
  return system.elimination->multiplications;
}

void factor_joint_rows(std::span<const SolverBody> bodies, JointSystem& system,
                       double regularisation) {
  factor_multiplications(std::numeric_limits<double>::infinity(), system);
  system.regularisation = regularisation;
  system.factored = true;
  const auto scales = assemble_joint_rows(bodies, regularisation, system);
  system.matrix.factor(system.elimination->pattern, as_span(scales));
}

void solve_joint_rows(const JointSystem& system, std::span<double> rows) {
  if (system.in_place) return system.matrix.solve(system.elimination->pattern, rows);
  ShortList<double, 32> unknowns(system.matrix.rows(), 0.0);
  const std::vector<std::uint32_t>& place = system.place_of_row;
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (place[r] != kNoPlace) unknowns[place[r]] = rows[r];
  system.matrix.solve(system.elimination->pattern, {unknowns.data(), unknowns.size()});
  for (std::size_t r = 0; r < rows.size(); ++r)
    rows[r] = place[r] != kNoPlace ? unknowns[place[r]] : 0.0;
}

double velocity_of(const JointRow& row, std::span<const SolverBody> bodies) {
  const SolverBody& a = bodies[row.a];
  const SolverBody& b = bodies[row.b];
  return row.linear.dot(b.linear - a.linear) + row.angular_b.dot(b.angular) -
         row.angular_a.dot(a.angular);
}

void apply_joint_impulse(const JointRow& row, double impulse, std::span<SolverBody> bodies) {
  SolverBody& a = bodies[row.a];
  SolverBody& b = bodies[row.b];
  a.linear -= row.linear * (a.inverse_mass * impulse);
  a.angular -= a.inverse_inertia * row.angular_a * impulse;
  b.linear += row.linear * (b.inverse_mass * impulse);
  b.angular += b.inverse_inertia * row.angular_b * impulse;
}

void add_joint_impulses(std::span<const double> impulses, JointSystem& system,
                        std::span<SolverBody> bodies) {
  for (std::size_t r = 0; r < impulses.size(); ++r) {
    JointRow& row = system.rows[r];
    const double impulse = impulses[r];
    row.impulse_newton_s += impulse;
    SolverBody& a = bodies[row.a];
    a.linear -= row.linear * (a.inverse_mass * impulse);
    a.angular -= system.twists[r].a * impulse;
    SolverBody& b = bodies[row.b];
    if (!(b.inverse_mass > 0.0)) continue;
    b.linear += row.linear * (b.inverse_mass * impulse);
    b.angular += system.twists[r].b * impulse;
  }
}

// Springs: impulse = -dt (stiffness * stretch at the end + damping * velocity), with the stretch at
// the end linear in the velocity. Joints: the same with a stiffness without bound.
void aim_joint_rows(double dt_s, std::span<const SolverBody> bodies, JointSystem& system) {
  for (JointRow& row : system.rows) {
    if (row.kind == JointRowKind::kMotor) continue;
    const double share = row.softness_1_kg > 0.0 ? row.stiffness_share_1_s : 1.0 / dt_s;
    row.target_m_s = share * (dt_s * velocity_of(row, bodies) - row.error);
  }
}

void take_back_joint_impulses(JointSystem& system, std::span<SolverBody> bodies) {
  for (JointRow& row : system.rows) apply_joint_impulse(row, -row.impulse_newton_s, bodies);
}

void solve_joint_velocities(JointSystem& system, std::span<SolverBody> bodies) {
  std::vector<double> change(system.rows.size());
  for (std::size_t r = 0; r < change.size(); ++r) {
    const JointRow& row = system.rows[r];
    change[r] =
        row.target_m_s - velocity_of(row, bodies) - row.softness_1_kg * row.impulse_newton_s;
  }
  solve_joint_rows(system, change);
  add_joint_impulses(change, system, bodies);
}

void stop_joint_velocities(std::span<SolverBody> bodies, JointSystem& system, bool factored) {
  const std::vector<SolverBody> before(bodies.begin(), bodies.end());
  for (const double regularisation : {0.0, 1e-10, 1e-8, 1e-6, 1e-4}) {
    if (!factored || regularisation > 0.0) factor_joint_rows(bodies, system, regularisation);
    solve_bounded(bodies, regularisation, system);
    double gained = 0.0, moved = 0.0;  // energy: half the impulses times both velocities
    for (const JointRow& row : system.rows) {
      if (row.kind == JointRowKind::kMotor && row.impulse_newton_s != 0.0) return;
      const double work =
          0.5 * row.impulse_newton_s * (velocity_of(row, before) + velocity_of(row, bodies));
      gained += work;
      moved += std::abs(work);
    }
    if (gained <= 1e-9 * moved) return;
    std::copy(before.begin(), before.end(), bodies.begin());
    for (JointRow& row : system.rows) row.impulse_newton_s = 0.0;
    rest_bounds(system);
  }
}

void solve_joint_errors(const JointSystem& system, std::span<const SolverBody> bodies,
                        std::vector<JointMove>& moves) {
  std::vector<double> push(system.rows.size());
  for (std::size_t r = 0; r < push.size(); ++r)
    push[r] = system.rows[r].softness_1_kg > 0.0 ? 0.0 : -system.rows[r].error;
  solve_joint_rows(system, push);
  moves.assign(bodies.size(), {});
  for (std::size_t r = 0; r < push.size(); ++r) {
    const JointRow& row = system.rows[r];
    JointMove& a = moves[row.a];
    JointMove& b = moves[row.b];
    a.linear -= row.linear * (bodies[row.a].inverse_mass * push[r]);
    a.angular -= bodies[row.a].inverse_inertia * row.angular_a * push[r];
    b.linear += row.linear * (bodies[row.b].inverse_mass * push[r]);
    b.angular += bodies[row.b].inverse_inertia * row.angular_b * push[r];
  }
}

double largest_error(const JointSystem& system) {
  double largest = 0.0;
  for (const JointRow& row : system.rows)
    if (is_to_be_closed(row))
      largest = std::isfinite(row.error) ? std::max(largest, std::abs(row.error))
                                         : std::numeric_limits<double>::infinity();
  return largest;
}

double norm_of_errors(const JointSystem& system) {
  double squares = 0.0;
  for (const JointRow& row : system.rows)
    if (is_to_be_closed(row)) squares += row.error * row.error;
  return std::sqrt(squares);
}

}  // namespace soda::physics
