// Rolling and torsional friction: contacts that turn bodies back as these roll and spin.
#pragma once

#include "physics/constraints/contact_rows.hpp"

namespace soda::physics {

// Two directions orthogonal to a unit vector and to each other.
struct Tangents {
  Vec3 first, second;
};
Tangents tangents_of(const Vec3& normal);

// Coefficients of a pair: the larger ones of its materials.
struct RollingFriction {
  double rolling_m = 0.0, torsional_m = 0.0;

  explicit operator bool() const { return rolling_m > 0.0 || torsional_m > 0.0; }
};
RollingFriction rolling_friction(const Material& a, const Material& b);
inline bool turns_back_rolling(const Material& material) {
  return material.rolling_friction_m > 0.0 || material.torsional_friction_m > 0.0;
}

// Of a manifold whose bodies have these places in the problem, and whose normal rows come next.
RollingRow rolling_row(const RollingFriction& friction, std::uint32_t a, std::uint32_t b,
                       const ContactManifold& manifold, const ContactProblem& problem);

// The impulse that stops what slides or turns at this velocity with the impulse `old`, if the disc
// of impulses up to `limit` allows it. Else a step along the velocity itself, so that it opposes
// the motion exactly however differently the two directions respond. `inverse`: of the 2x2 matrix
// of responses; `slide`: of its largest eigenvalue.
Tangential impulse_in_disc(const double (&inverse)[3], double slide, double limit,
                           const Tangential& old, const Tangential& velocity);
inline Tangential stopping_impulse(const double (&inverse)[3], const Tangential& old,
                                   const Tangential& velocity) {
  const auto [v0, v1] = velocity;
  return {old[0] - (inverse[0] * v0 + inverse[1] * v1),
          old[1] - (inverse[1] * v0 + inverse[2] * v1)};
}

// The sum of the normal impulses, newton s.
double pressing(const RollingRow& row, const ContactProblem& problem);
// The torque impulse on b, world frame.
inline Vec3 torque_impulse(const RollingRow& row) {
  const Vec3& along = row.impulse_newton_m_s;
  return row.axis[0] * along[0] + row.axis[1] * along[1] + row.axis[2] * along[2];
}
// Gives the bodies a change of the impulse.
void apply_rolling_impulse(const RollingRow& row, const Vec3& change_newton_m_s,
                           ContactProblem& problem);

// One iteration over the rolling rows. Returns the largest change of an impulse, as one of a force
// at the radius of gyration.
double iterate_rolling(ContactProblem& problem);

// Rolling rows bear what the other impulses leave to them: iterations over the rolling rows alone,
// at most `iterations`.
void bear_rolling(int iterations, ContactProblem& problem);

// The largest velocity, at a radius of gyration, that a rolling row would still change.
double rolling_residual_m_s(const ContactProblem& problem);

// Impulses become from + share (to - from), where `to` is what they are; no `from`: nothing.
// Velocities stay.
void mix_rolling(double share, std::span<const RollingRow> from, ContactProblem& problem);

}  // namespace soda::physics
