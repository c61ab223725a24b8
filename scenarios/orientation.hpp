// Orientations as the file gives them, made into unit quaternions with the same bits everywhere.
#pragma once

#include "physics/model/ids.hpp"
#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"

namespace soda::scenarios {

struct SineCosine {
  double sine = 0.0, cosine = 1.0;
};

// Of an angle in degrees, |angle_deg| <= 1e6; error below 2e-16, exact at multiples of 90. The C
// library's functions give other bits on processors with FMA.
SineCosine sine_cosine_of_degrees(double angle_deg);

// Where the file gives it; null if it does not.
const JsonValue* located(const OrientationSpec& spec);

// Identity, and a fault, if the norm of the quaternion or axis is not acceptable.
physics::Quat orientation_of(const OrientationSpec& spec, FaultList& faults);

}  // namespace soda::scenarios
