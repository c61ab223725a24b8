// How contacts and joints give way within substeps (Catto 2011, "Soft constraints").
#pragma once

namespace soda::physics {

// A damped spring over one substep: the share of what is off that goes, and of the row's response
// and impulse what it takes and gives way. As it stands: rigid, of velocities alone.
struct Softness {
  double rate = 0.0, mass_share = 1.0, impulse_share = 0.0;
};

// `phase`: the angle that the spring's oscillation makes in a substep; `damping`: of the critical
// one.
constexpr Softness spring_of(double phase, double damping) {
  const double firm = phase * (2.0 * damping + phase);
  return {phase / (2.0 * damping + phase), firm / (1.0 + firm), 1.0 / (1.0 + firm)};
}

// An eighth of an oscillation.
inline constexpr double kPhaseOfSubstep = 2.0 * 3.14159265358979323846 * 0.125;

}  // namespace soda::physics
