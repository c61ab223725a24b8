// A quick look at two boxes, before the axis of their contact is sought.
#pragma once

#include "physics/math/pose.hpp"

namespace soda::physics {

// Whether a face of one of two boxes (half_m: their half extents) separates them, by clearly more
// than rounding. True: no separating-axis test finds that they meet. False says nothing.
bool face_separates(const Pose& a, const Vec3& half_a_m, const Pose& b, const Vec3& half_b_m);

}  // namespace soda::physics
