// Along which direction two solids meet: what FCL says of it, and what own code does.
#pragma once

#include "physics/narrowphase/separation.hpp"

namespace soda::physics {

// Where and along which direction (from a to b) two solids meet.
struct Axis {
  bool found = false;  // false: they are farther apart than the range
  // The solids are nearest to each other along it, or along a face about as near.
  bool nearest = false;
  Vec3 normal = Vec3::UnitZ();
  Vec3 witness = Vec3::Zero();  // a point between the surfaces
};

// Of two boxes.
Axis fcl_box_axis(const Solid& a, const Solid& b, double range_m, StageCounters& counters);
Axis own_box_axis(const Solid& a, const Solid& b, double range_m);

// Of any solids but halfspaces and meshes.
Axis own_axis(const Solid& a, const Solid& b, double range_m);
// The scene's narrowphase is kFcl: else its shapes have no FCL objects. Where FCL gives no answer
// that is one, own_axis(), and a failure is counted.
Axis fcl_axis(const Solid& a, const Solid& b, double range_m, StageCounters& counters);

// Along the normal of a face of b. Where a face of a serves as well, rounding would decide which of
// both is taken; then it is always a's, so that features do not flicker.
Vec3 first_face_normal(const PlacedShape& a, const PlacedShape& b, const Vec3& normal);

// Replaces an axis that is found by a face normal of either shape that separates more, or as much
// within a tolerance that favours faces (a twentieth of the depth and a share of the smaller
// width): corrects wrong faces, and gives face contacts an exact normal.
void refine_by_faces(const Solid& a, const Solid& b, double slack_share, Axis& axis);
inline constexpr double kFaceSlack = 1e-4;

}  // namespace soda::physics
