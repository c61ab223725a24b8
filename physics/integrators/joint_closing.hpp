// Poses that joints do not hold: moved to where they do.
#pragma once

#include <span>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// Moves the bodies so that no joint that is no spring is off, by as little as their masses allow.
// Where that leads nowhere (a light link between heavy bodies would have to turn far, taut chains
// can hardly be drawn straight), by as little as if all were of the same mass, and only as far as
// all that gives at most `most_joule`. In any case only so far that it gives no more than that, or
// than the energy of a fall of one step: the next step goes on. No correction makes the largest
// error greater; what cannot be closed stays. Velocities turn along. Returns the energy that this
// gives.
double close_joints(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                    double most_joule, JointSystem& joints, std::span<BodyState> states);

// Whether joints hold these poses but for rounding. Builds their rows.
bool are_closed(const SceneDescription& scene, double dt_s, std::span<const BodyState> states,
                JointSystem& joints);

// Closes, without velocity, what earlier steps have left open of the joints, and what lies on the
// bodies gives way: rows of contacts at these states, if there are any. The energy that this gives
// is taken from the velocities; what these have not is added to the position correction.
void close_left_open(const IslandStep& island, const ContactProblem* problem, JointSystem& joints,
                     std::span<BodyState> states, IslandReport& report);

}  // namespace soda::physics
