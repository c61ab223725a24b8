// Springs in islands that nothing touches: exact where the motion is linear, else as explicit
// impulses on the bodies of an articulated island.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// A linear oscillator x'' = -w^2 x - 2 b x' after a time: place = keeps x + turns x', and speed =
// -w^2 turns x + speed x'. Exact to some roundings of b t and of the phase, for any w > 0, b >= 0
// and time > 0, without libm.
struct Oscillation {
  double keeps = 1.0, turns_s = 0.0, speed = 1.0;
};
Oscillation oscillate(double squared_rate_1_s2, double damping_1_s, double time_s);

// Advances an island that is one spring between two bodies, or a body and the world, if the motion
// is linear: its line goes through the centres of mass and does not turn, and neither do the ends
// meet (or the spring has no length at rest and no damping); only fields act besides. That is
// exact for any stiffness and any dt_s. False, and no change, for any other island. `joints`: those
// of the island, whose bodies have the `states`.
bool advance_single_spring(const SceneDescription& scene, double dt_s, const JointSystem& joints,
                           std::span<BodyState> states, IslandReport& report,
                           std::vector<AdvanceFault>& faults);

// Bounds of how fast these springs can swing the bodies (rad/s), and damp them (1/s).
struct SpringRates {
  double swing_rad_s = 0.0, damping_1_s = 0.0;
};
SpringRates rates_of(std::span<const SpringRow> springs, std::span<const SolverBody> bodies);

// How many parts of a step of dt_s are short enough for explicit impulses.
double parts_for(const SpringRates& rates, double dt_s);

// What the springs do to the velocities in a time (of any sign), at fixed poses: one after the
// other, each by the trapezoidal rule. Backwards is the last one first: then impulses before and
// after a motion are symmetric in time. `states` as for the rows; what the world gives is reported.
void apply_spring_impulses(std::span<const SpringRow> springs, double time_s, bool backwards,
                           std::span<const BodyState> states, std::span<SolverBody> bodies,
                           IslandReport& report);

double elastic_joule(std::span<const SpringRow> springs);
// Of all springs among the joints.
double elastic_joule(const SceneDescription& scene, const JointSystem& joints,
                     std::span<const BodyState> states);

}  // namespace soda::physics
