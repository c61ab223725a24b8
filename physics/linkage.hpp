// Islands that joints hold and nothing touches.
#pragma once

#include <span>
#include <vector>

#include "physics/advance.hpp"
#include "physics/joint_rows.hpp"

namespace soda::physics {

// Advances an island that joints hold and nothing touches. All but springs hold at both ends of the
// step, in place and in velocity (RATTLE with the free rotation of each body, symmetric in time:
// second order with limits, motors, drives or damping, else five of them for the fourth). Springs
// kick the bodies (springs.hpp). `report` has its label;
// to its impulse by statics is added what damping and drives gave beyond what drive_impulse
// (measures.hpp) tells of the start, as velocities that the joints change are damped. False, and no
// change, if that does not work out because the joints are nearly contradictory, or with springs
// that are too stiff or not of the fourth order: then they have to be solved as beside contacts.
bool advance_linkage(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     JointSystem& joints, std::span<BodyState> states, IslandReport& report,
                     std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
