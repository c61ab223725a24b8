#include "physics/constraints/rolling_rows.hpp"

#include <algorithm>
#include <cmath>

#include "physics/math/rigid_motion.hpp"

namespace soda::physics {

Tangents tangents_of(const Vec3& n) {
  const Vec3 axis = std::abs(n.x()) < 0.6 ? Vec3(Vec3::UnitX()) : Vec3(Vec3::UnitY());
  const Vec3 first = n.cross(axis).normalized();
  return {first, n.cross(first)};
}

RollingFriction rolling_friction(const Material& a, const Material& b) {
  return {std::max(a.rolling_friction_m, b.rolling_friction_m),
          std::max(a.torsional_friction_m, b.torsional_friction_m)};
}

RollingRow rolling_row(const RollingFriction& friction, std::uint32_t a, std::uint32_t b,
                       const ContactManifold& manifold, const ContactProblem& problem) {
  RollingRow row;
  row.a = a;
  row.b = b;
  row.first_normal = static_cast<std::uint32_t>(problem.normals.size());
  row.points = manifold.count;
  row.rolling_m = friction.rolling_m;
  row.torsional_m = friction.torsional_m;
  const Tangents tangents = tangents_of(manifold.normal);
  row.axis[0] = tangents.first;
  row.axis[1] = tangents.second;
  row.axis[2] = manifold.normal;
  const SolverBody &x = problem.bodies[a], &y = problem.bodies[b];
  const auto response = [&](int by, int of) {
    const Vec3& axis = row.axis[by];
    return row.axis[of].dot(times(x.inverse_inertia, axis) + times(y.inverse_inertia, axis));
  };
  const double k11 = response(0, 0), k12 = response(0, 1), k22 = response(1, 1);
  const double determinant = k11 * k22 - k12 * k12;
  row.inverse[0] = k22 / determinant;
  row.inverse[1] = -k12 / determinant;
  row.inverse[2] = k11 / determinant;
  const double difference = 0.5 * (k11 - k22);
  const double largest = 0.5 * (k11 + k22) + std::sqrt(difference * difference + k12 * k12);
  row.slide_inertia_kg_m2 = 1.0 / largest;
  row.torsional_inertia_kg_m2 = 1.0 / response(2, 2);
  row.gyration_m = std::sqrt((x.inverse_mass + y.inverse_mass) / largest);
  return row;
}

Tangential impulse_in_disc(const double (&inverse)[3], double slide, double limit,
                           const Tangential& old, const Tangential& velocity) {
  Tangential impulse = stopping_impulse(inverse, old, velocity);
  if (!(impulse[0] * impulse[0] + impulse[1] * impulse[1] > limit * limit)) return impulse;
  impulse = {old[0] - slide * velocity[0], old[1] - slide * velocity[1]};
  const double length = std::sqrt(impulse[0] * impulse[0] + impulse[1] * impulse[1]);
  if (length > limit)
    for (double& part : impulse) part *= limit / length;
  return impulse;
}

double pressing(const RollingRow& row, const ContactProblem& problem) {
  double sum = 0.0;
  for (std::uint32_t i = 0; i < row.points; ++i)
    sum += problem.normals[row.first_normal + i].impulse_newton_s;
  return sum;
}

void apply_rolling_impulse(const RollingRow& row, const Vec3& change, ContactProblem& problem) {
  const Vec3 torque = row.axis[0] * change[0] + row.axis[1] * change[1] + row.axis[2] * change[2];
  SolverBody &a = problem.bodies[row.a], &b = problem.bodies[row.b];
  a.angular -= times(a.inverse_inertia, torque);
  b.angular += times(b.inverse_inertia, torque);
}

namespace {

// In the contact plane, at the present velocities.
Vec3 rolled(const RollingRow& row, double pressing, const ContactProblem& problem) {
  const Vec3& old = row.impulse_newton_m_s;
  const Vec3 turning = problem.bodies[row.b].angular - problem.bodies[row.a].angular;
  const Tangential now =
      impulse_in_disc(row.inverse, row.slide_inertia_kg_m2, row.rolling_m * pressing,
                      {old[0], old[1]}, {turning.dot(row.axis[0]), turning.dot(row.axis[1])});
  return {now[0], now[1], old[2]};
}

// About the normal.
Vec3 spun(const RollingRow& row, double pressing, const ContactProblem& problem) {
  Vec3 now = row.impulse_newton_m_s;
  const Vec3 turning = problem.bodies[row.b].angular - problem.bodies[row.a].angular;
  const double limit = row.torsional_m * pressing;
  now[2] =
      std::clamp(now[2] - row.torsional_inertia_kg_m2 * turning.dot(row.axis[2]), -limit, limit);
  return now;
}

double take(const Vec3& now, RollingRow& row, ContactProblem& problem) {
  const Vec3 change = now - row.impulse_newton_m_s;
  if (change == Vec3::Zero()) return 0.0;
  row.impulse_newton_m_s = now;
  apply_rolling_impulse(row, change, problem);
  return std::max({std::abs(change[0]), std::abs(change[1]), std::abs(change[2])}) / row.gyration_m;
}

}  // namespace

double iterate_rolling(ContactProblem& problem) {
  double change = 0.0;
  for (RollingRow& row : problem.rollings) {
    const double pressed = pressing(row, problem);
    if (pressed == 0.0 && row.impulse_newton_m_s == Vec3::Zero()) continue;
    change = std::max(change, take(rolled(row, pressed, problem), row, problem));
    change = std::max(change, take(spun(row, pressed, problem), row, problem));
  }
  return change;
}

void bear_rolling(int iterations, ContactProblem& problem) {
  constexpr double kNegligible = 1e-15;  // change, of the largest normal impulse
  if (problem.rollings.empty()) return;
  double largest = 0.0;
  for (const NormalRow& row : problem.normals) largest = std::max(largest, row.impulse_newton_s);
  for (int i = 0; i < iterations; ++i)
    if (iterate_rolling(problem) <= kNegligible * largest) return;
}

double rolling_residual_m_s(const ContactProblem& problem) {
  double residual = 0.0;
  for (const RollingRow& row : problem.rollings) {
    const double pressed = pressing(row, problem);
    const Vec3 left = rolled(row, pressed, problem) - row.impulse_newton_m_s;
    const Vec3 torsional = spun(row, pressed, problem) - row.impulse_newton_m_s;
    const double rad_s = std::max(left.norm() / row.slide_inertia_kg_m2,
                                  torsional.norm() / row.torsional_inertia_kg_m2);
    residual = std::max(residual, rad_s * row.gyration_m);
  }
  return residual;
}

void mix_rolling(double share, std::span<const RollingRow> from, ContactProblem& problem) {
  for (std::size_t i = 0; i < problem.rollings.size(); ++i) {
    Vec3& impulse = problem.rollings[i].impulse_newton_m_s;
    const Vec3 start = from.empty() ? Vec3(Vec3::Zero()) : from[i].impulse_newton_m_s;
    impulse = start + (impulse - start) * share;
  }
}

}  // namespace soda::physics
