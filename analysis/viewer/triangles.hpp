// Shapes as triangles, to be looked at.
#pragma once

#include <span>
#include <vector>

#include "physics/model/scene.hpp"

namespace soda::analysis {

// Corners of triangles, three by three, counter-clockwise seen from outside, in the shape's frame:
// x, y, z in m, then the outward normal. 6 floats a corner.
using Triangles = std::vector<float>;

// What is round is drawn with so many `sides` (a multiple of 4); its corners lie on the surface, so
// its faces lie inside. A
// half space is a square around `middle_m` (in the shape's frame), `reach_m` to each side.
// `shapes`: those that a compound's parts are of.
Triangles triangles_of(const physics::Shape& shape, std::span<const physics::Shape> shapes,
                       const physics::Vec3& middle_m, double reach_m, int sides = 24);

}  // namespace soda::analysis
