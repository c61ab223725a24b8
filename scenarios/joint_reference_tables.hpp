// The tables of what is known of bodies with forces and joints.
#pragma once

#include "scenarios/field_table.hpp"

namespace soda::scenarios {

extern const ObjectTable kForcedFlight, kDampedOscillator, kSteadyPrecession, kJointTravel,
    kHangingChain, kJointsHold;

}  // namespace soda::scenarios
