#include "physics/solvers/contact_solver.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/solvers/dense_contact_solver.hpp"

namespace soda::physics {
namespace {

constexpr double kNegligible = 1e-10;  // change of an impulse, of the largest impulse

// Returns the change of the impulse.
double solve_row(NormalRow& row, SolverBody& a, SolverBody& b) {
  const double velocity =
      row.normal.dot(b.linear - a.linear) + row.arm_b.dot(b.angular) - row.arm_a.dot(a.angular);
  const double wanted = row.impulse_newton_s + row.mass_kg * (row.target_m_s - velocity);
  const double impulse = wanted > 0.0 ? wanted : 0.0;
  const double change = impulse - row.impulse_newton_s;
  if (change == 0.0) return 0.0;
  row.impulse_newton_s = impulse;
  a.linear -= row.normal * (a.inverse_mass * change);
  a.angular -= row.response_a * change;
  b.linear += row.normal * (b.inverse_mass * change);
  b.angular += row.response_b * change;
  return std::abs(change);
}

double solve_row(FrictionRow& row, double normal_impulse, SolverBody& a, SolverBody& b) {
  const double limit = row.friction * normal_impulse;
  const Tangential old{row.impulse_newton_s[0], row.impulse_newton_s[1]};
  if (limit == 0.0 && old == Tangential{}) return 0.0;
  const Vec3 velocity =
      b.linear + b.angular.cross(row.arm_b) - a.linear - a.angular.cross(row.arm_a);
  const Tangential now = friction_impulse(
      row, limit, old, {velocity.dot(row.tangent[0]), velocity.dot(row.tangent[1])});
  const double change0 = now[0] - old[0], change1 = now[1] - old[1];
  row.impulse_newton_s[0] = now[0];
  row.impulse_newton_s[1] = now[1];
  if (change0 == 0.0 && change1 == 0.0) return 0.0;
  const Vec3 change = row.tangent[0] * change0 + row.tangent[1] * change1;
  a.linear -= change * a.inverse_mass;
  a.angular -= times(a.inverse_inertia, row.arm_a.cross(change));
  b.linear += change * b.inverse_mass;
  b.angular += times(b.inverse_inertia, row.arm_b.cross(change));
  return std::max(std::abs(change0), std::abs(change1));
}

// Alternating directions carry a load through a stack as fast downwards as upwards.
double iterate_normals(bool forward, ContactProblem& p) {
  double change = 0.0;
  const std::size_t count = p.normals.size();
  for (std::size_t k = 0; k < count; ++k) {
    NormalRow& row = p.normals[forward ? k : count - 1 - k];
    change = std::max(change, solve_row(row, p.bodies[row.a], p.bodies[row.b]));
  }
  return change;
}

double largest_impulse(const ContactProblem& p) {
  double largest = 0.0;
  for (const NormalRow& row : p.normals) largest = std::max(largest, row.impulse_newton_s);
  return largest;
}

}  // namespace

Tangential friction_impulse(const FrictionRow& row, double limit, const Tangential& old,
                            const Tangential& velocity_m_s) {
  return impulse_in_disc(row.inverse, row.slide_mass_kg, limit, old, velocity_m_s);
}

double iterate_frictions(ContactProblem& p) {
  double change = p.rollings.empty() ? 0.0 : iterate_rolling(p);
  for (FrictionRow& row : p.frictions) {
    const double normal = p.normals[row.normal_row].impulse_newton_s;
    change = std::max(change, solve_row(row, normal, p.bodies[row.a], p.bodies[row.b]));
  }
  return change;
}

double iterate_velocities(bool forward, ContactProblem& problem) {
  const double change = iterate_frictions(problem);
  return std::max(change, iterate_normals(forward, problem));
}

namespace {

// Iterations after which so many are to be expected that points are worth loading. A single body
// meets statics in all of its points at once: more than one take many.
int worth_loading_after(const ContactProblem& problem) {
  const std::size_t points = problem.normals.size();
  const bool single = std::ranges::count_if(problem.bodies, [](const SolverBody& body) {
                        return body.inverse_mass > 0.0;
                      }) == 1;
  if (single && points > 1) return points == 2 ? 1 : 3;
  return points <= 2 ? 2 : 12;
}

}  // namespace

int solve_velocities(int iterations, ContactProblem& problem) {
  const int worth_loading = worth_loading_after(problem);
  const bool few = are_few(problem);
  for (int i = 0; i < iterations; ++i) {
    if (few && i == worth_loading) return solve_dense_contacts(i, iterations, kNegligible, problem);
    const double change = iterate_velocities(i % 2 == 0, problem);
    if (change <= kNegligible * largest_impulse(problem)) return i + 1;
  }
  return iterations;
}

bool set_restitution_targets(ContactProblem& problem) {
  bool any = false;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    RowContact& contact = problem.contacts[i];
    if (!contact.bounces) continue;
    contact.bounces = problem.normals[i].impulse_newton_s > 0.0;
    if (!contact.bounces) continue;
    problem.normals[i].target_m_s = contact.rebound_m_s;
    any = true;
  }
  return any;
}

bool needs_position_correction(const ContactProblem& problem) {
  constexpr double kEnough =
      1.01;  // slops: the last of an overlap goes slowly, and is not worth it
  return std::any_of(problem.contacts.begin(), problem.contacts.end(),
                     [](const RowContact& c) { return c.separation_m < -kEnough * c.slop_m; });
}

double correction_target_m_s(const RowContact& c, double dt_s) {
  constexpr double kShare = 0.2;  // of the excess overlap, per step
  const double excess = -c.separation_m - c.slop_m;
  // Points in touch must not be pushed together; points apart have their gap to use.
  return excess > 0.0 ? std::min(kShare * excess / dt_s, c.fastest_correction_m_s)
                      : -std::max(c.separation_m, 0.0) / dt_s;
}

void set_correction_targets(double dt_s, const ContactProblem& problem,
                            PositionCorrectionProblem& correction) {
  const std::size_t count = problem.normals.size();
  correction.bodies.assign(problem.bodies.size(), {});
  correction.target_m_s.resize(count);
  correction.impulse_newton_s.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    correction.target_m_s[i] = correction_target_m_s(problem.contacts[i], dt_s);
  }
}

PositionCorrectionIteration iterate_position_correction(bool forward, const ContactProblem& problem,
                                                        PositionCorrectionProblem& correction) {
  PositionCorrectionIteration done;
  const std::size_t count = problem.normals.size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = forward ? k : count - 1 - k;
    const NormalRow& row = problem.normals[i];
    PositionCorrection& a = correction.bodies[row.a];
    PositionCorrection& b = correction.bodies[row.b];
    double& impulse = correction.impulse_newton_s[i];
    const double velocity =
        row.normal.dot(b.linear - a.linear) + row.arm_b.dot(b.angular) - row.arm_a.dot(a.angular);
    const double wanted =
        std::max(0.0, impulse + row.mass_kg * (correction.target_m_s[i] - velocity));
    const double step = wanted - impulse;
    impulse = wanted;
    a.linear -= row.normal * (problem.bodies[row.a].inverse_mass * step);
    a.angular -= row.response_a * step;
    b.linear += row.normal * (problem.bodies[row.b].inverse_mass * step);
    b.angular += row.response_b * step;
    done.change_newton_s = std::max(done.change_newton_s, std::abs(step));
    done.largest_newton_s = std::max(done.largest_newton_s, wanted);
  }
  return done;
}

void solve_position_correction(int iterations, double dt_s, const ContactProblem& problem,
                               PositionCorrectionProblem& correction) {
  correction.bodies.clear();
  if (!needs_position_correction(problem)) return;
  set_correction_targets(dt_s, problem, correction);
  for (int i = 0; i < iterations; ++i) {
    const PositionCorrectionIteration done =
        iterate_position_correction(i % 2 == 0, problem, correction);
    if (done.change_newton_s <= 1e-3 * done.largest_newton_s) return;  // the next step goes on
  }
}

double residual_m_s(const ContactProblem& problem) {
  double residual = 0.0;
  for (const NormalRow& row : problem.normals) {
    const SolverBody& a = problem.bodies[row.a];
    const SolverBody& b = problem.bodies[row.b];
    const double velocity =
        row.normal.dot(b.linear - a.linear) + row.arm_b.dot(b.angular) - row.arm_a.dot(a.angular);
    residual = std::max(residual, row.target_m_s - velocity);
  }
  for (const FrictionRow& row : problem.frictions) {
    const double length = std::sqrt(row.impulse_newton_s[0] * row.impulse_newton_s[0] +
                                    row.impulse_newton_s[1] * row.impulse_newton_s[1]);
    const double limit = row.friction * problem.normals[row.normal_row].impulse_newton_s;
    const double of_a = problem.bodies[row.a].inverse_mass;
    residual = std::max(
        residual, (length - limit) * (of_a > 0.0 ? of_a : problem.bodies[row.b].inverse_mass));
  }
  if (!problem.rollings.empty()) residual = std::max(residual, rolling_residual_m_s(problem));
  return residual;
}

}  // namespace soda::physics
