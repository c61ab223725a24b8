// The direct solution of joint rows.
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/constraints/joint_rows.hpp"
#include "physics/constraints/limits_and_motors.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"

namespace soda::physics {
namespace {

// What impulses along `y` do to the velocity of `x`, by the bodies that both have.
double coupling(const JointRow& x, const JointRow& y, const RowTwist& twist_y,
                std::span<const SolverBody> bodies, std::uint32_t world) {
  const double along = x.linear.dot(y.linear);
  double sum = 0.0;
  if (x.a == y.a) sum += bodies[x.a].inverse_mass * along + x.angular_a.dot(twist_y.a);
  if (x.a == y.b) sum -= bodies[x.a].inverse_mass * along + x.angular_a.dot(twist_y.b);
  if (x.b == world) return sum;
  if (x.b == y.a) sum -= bodies[x.b].inverse_mass * along + x.angular_b.dot(twist_y.a);
  if (x.b == y.b) sum += bodies[x.b].inverse_mass * along + x.angular_b.dot(twist_y.b);
  return sum;
}

void find_twists(JointSystem& system, std::span<const SolverBody> bodies) {
  system.twists.resize(system.rows.size());
  for (std::size_t r = 0; r < system.rows.size(); ++r) {
    const JointRow& row = system.rows[r];
    const SolverBody &a = bodies[row.a], &b = bodies[row.b];
    system.twists[r].a = times(a.inverse_inertia, row.angular_a);
    system.twists[r].b =
        b.inverse_mass > 0.0 ? times(b.inverse_inertia, row.angular_b) : Vec3(Vec3::Zero());
  }
}

bool share_a_body(const JointRow& x, const JointRow& y, std::uint32_t world) {
  return (x.a == y.a || x.a == y.b) || (x.b != world && (x.b == y.a || x.b == y.b));
}

// Of each row.
void find_first_columns(const JointSystem& system, std::vector<std::uint32_t>& first) {
  const std::vector<std::uint32_t>& begin = system.first_row;
  first.resize(begin.back());
  for (std::size_t j = 0; j < system.joints.size(); ++j)
    std::fill(first.begin() + begin[j], first.begin() + begin[j + 1], begin[system.earliest[j]]);
}

bool is_to_be_closed(const JointRow& row) {
  const bool open = row.kind == JointRowKind::kLimit && row.idle && row.error > 0.0;
  return !(row.softness_1_kg > 0.0) && !open;
}

}  // namespace

std::uint64_t factor_multiplications(const JointSystem& system) {
  std::vector<std::uint32_t> first;
  find_first_columns(system, first);
  return EnvelopeMatrix::factor_multiplications(first);
}

void factor_joint_rows(std::size_t body_count, std::span<const SolverBody> bodies,
                       JointSystem& system, double regularisation) {
  const auto world = static_cast<std::uint32_t>(body_count);
  const std::vector<std::uint32_t>& begin = system.first_row;
  std::vector<JointRow>& rows = system.rows;
  find_first_columns(system, system.first_column);
  system.matrix.reset(system.first_column);
  system.regularisation = regularisation;
  system.factored = true;
  find_twists(system, bodies);
  for (std::size_t j = 0; j < system.joints.size(); ++j)
    for (std::size_t k = system.earliest[j]; k <= j; ++k) {
      if (!share_a_body(rows[begin[j]], rows[begin[k]], world)) continue;
      for (std::uint32_t r = begin[j]; r < begin[j + 1]; ++r)
        for (std::uint32_t c = begin[k]; c < begin[k + 1] && c <= r; ++c)
          if (!rows[r].idle && !rows[c].idle)
            system.matrix.at(r, c) = coupling(rows[r], rows[c], system.twists[c], bodies, world);
    }
  for (std::size_t r = 0; r < rows.size(); ++r)
    system.matrix.at(r, r) += rows[r].softness_1_kg + regularisation * system.matrix.at(r, r);
  system.matrix.factor();
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
  system.matrix.solve(change);
  add_joint_impulses(change, system, bodies);
}

void stop_joint_velocities(std::size_t body_count, std::span<SolverBody> bodies,
                           JointSystem& system, bool factored) {
  const std::vector<SolverBody> before(bodies.begin(), bodies.end());
  for (const double regularisation : {0.0, 1e-10, 1e-8, 1e-6, 1e-4}) {
    if (!factored || regularisation > 0.0)
      factor_joint_rows(body_count, bodies, system, regularisation);
    solve_bounded(body_count, bodies, regularisation, system);
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
  system.matrix.solve(push);
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
