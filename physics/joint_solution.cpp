// The direct solution of joint rows.
#include <algorithm>
#include <cmath>

#include "physics/joint_bounds.hpp"
#include "physics/joint_rows.hpp"

namespace soda::physics {
namespace {

// What an impulse along `y` does to the velocity of `x`, by the one body.
double response(const JointRow& x, double sign_x, const Vec3& turn_x, const JointRow& y,
                double sign_y, const Vec3& turn_y, const SolverBody& body) {
  return sign_x * sign_y *
         (body.inverse_mass * x.linear.dot(y.linear) + turn_x.dot(body.inverse_inertia * turn_y));
}

double coupling(const JointRow& x, const JointRow& y, std::span<const SolverBody> bodies) {
  const auto world = static_cast<std::uint32_t>(bodies.size());
  double sum = 0.0;
  const auto end = [](const JointRow& row, bool is_b) {
    return std::pair(is_b ? row.b : row.a, is_b ? 1.0 : -1.0);
  };
  for (const bool x_is_b : {false, true}) {
    for (const bool y_is_b : {false, true}) {
      const auto [body_x, sign_x] = end(x, x_is_b);
      const auto [body_y, sign_y] = end(y, y_is_b);
      if (body_x != body_y || body_x >= world) continue;
      sum += response(x, sign_x, x_is_b ? x.turn_b : x.turn_a, y, sign_y,
                      y_is_b ? y.turn_b : y.turn_a, bodies[body_x]);
    }
  }
  return sum;
}

bool share_a_body(const JointRow& x, const JointRow& y, std::uint32_t world) {
  return (x.a == y.a || x.a == y.b) || (x.b != world && (x.b == y.a || x.b == y.b));
}

}  // namespace

void factor_joint_rows(std::size_t body_count, std::span<const SolverBody> bodies,
                       JointSystem& system, double regularisation) {
  const auto world = static_cast<std::uint32_t>(body_count);
  const std::vector<std::uint32_t>& begin = system.first_row;
  std::vector<std::uint32_t> first(system.rows.size());
  for (std::size_t j = 0; j < system.joints.size(); ++j)
    std::fill(first.begin() + begin[j], first.begin() + begin[j + 1], begin[system.earliest[j]]);
  system.matrix.reset(first);
  for (std::size_t j = 0; j < system.joints.size(); ++j)
    for (std::size_t k = system.earliest[j]; k <= j; ++k) {
      if (!share_a_body(system.rows[begin[j]], system.rows[begin[k]], world)) continue;
      for (std::uint32_t r = begin[j]; r < begin[j + 1]; ++r)
        for (std::uint32_t c = begin[k]; c < begin[k + 1] && c <= r; ++c)
          if (!system.rows[r].idle && !system.rows[c].idle)
            system.matrix.at(r, c) =
                coupling(system.rows[r], system.rows[c], bodies.first(body_count));
    }
  for (std::size_t r = 0; r < system.rows.size(); ++r)
    system.matrix.at(r, r) +=
        system.rows[r].softness_1_kg + regularisation * system.matrix.at(r, r);
  system.matrix.factor();
}

double velocity_of(const JointRow& row, std::span<const SolverBody> bodies) {
  const SolverBody& a = bodies[row.a];
  const SolverBody& b = bodies[row.b];
  return row.linear.dot(b.linear - a.linear) + row.turn_b.dot(b.angular) -
         row.turn_a.dot(a.angular);
}

void apply_joint_impulse(const JointRow& row, double impulse, std::span<SolverBody> bodies) {
  SolverBody& a = bodies[row.a];
  SolverBody& b = bodies[row.b];
  a.linear -= row.linear * (a.inverse_mass * impulse);
  a.angular -= a.inverse_inertia * row.turn_a * impulse;
  b.linear += row.linear * (b.inverse_mass * impulse);
  b.angular += b.inverse_inertia * row.turn_b * impulse;
}

namespace {

// `change` are the right-hand sides, and then the impulses.
void add_impulses(std::span<double> change, JointSystem& system, std::span<SolverBody> bodies) {
  system.matrix.solve(change);
  for (std::size_t r = 0; r < change.size(); ++r) {
    system.rows[r].impulse_newton_s += change[r];
    apply_joint_impulse(system.rows[r], change[r], bodies);
  }
}

}  // namespace

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

void add_joint_impulses(JointSystem& system, std::span<SolverBody> bodies) {
  std::vector<double> change;
  for (const JointRow& row : system.rows) change.push_back(-row.error);
  add_impulses(change, system, bodies);
}

void solve_joint_velocities(JointSystem& system, std::span<SolverBody> bodies) {
  std::vector<double> change(system.rows.size());
  for (std::size_t r = 0; r < change.size(); ++r) {
    const JointRow& row = system.rows[r];
    change[r] =
        row.target_m_s - velocity_of(row, bodies) - row.softness_1_kg * row.impulse_newton_s;
  }
  add_impulses(change, system, bodies);
}

void stop_joint_velocities(std::size_t body_count, std::span<SolverBody> bodies,
                           JointSystem& system) {
  const std::vector<SolverBody> before(bodies.begin(), bodies.end());
  for (const double regularisation : {0.0, 1e-10, 1e-8, 1e-6, 1e-4}) {
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
    a.angular -= bodies[row.a].inverse_inertia * row.turn_a * push[r];
    b.linear += row.linear * (bodies[row.b].inverse_mass * push[r]);
    b.angular += bodies[row.b].inverse_inertia * row.turn_b * push[r];
  }
}

double largest_error(const JointSystem& system) {
  double largest = 0.0;
  for (const JointRow& row : system.rows) {
    const bool open = row.kind == JointRowKind::kLimit && row.idle && row.error > 0.0;
    if (!(row.softness_1_kg > 0.0) && !open) largest = std::max(largest, std::abs(row.error));
  }
  return largest;
}

}  // namespace soda::physics
