// Poses that joints do not hold: moved to where they do.
#pragma once

#include <span>

#include "physics/constraints/joint_rows.hpp"

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

}  // namespace soda::physics
