// Volume, centre and inertia of shapes; convex hulls of points.
#pragma once

#include <span>
#include <string>
#include <variant>

#include "physics/model/scene.hpp"

namespace soda::physics {

struct MassProperties {
  double volume_m3 = 0.0;
  Vec3 center_local_m = Vec3::Zero();
  Mat3 inertia_per_density_m5 = Mat3::Zero();  // about the centre, for density 1 kg/m^3
};

// Exact for all solid shapes. Zero for meshes and halfspaces, which are static only. Of a compound
// the sum over its parts, which are among `shapes`: where they overlap, mass counts twice.
MassProperties mass_properties(const Shape& shape, std::span<const Shape> shapes = {});

// The inertia of a mass about a point at this offset from its centre.
Mat3 inertia_about(const Mat3& about_center, double mass, const Vec3& offset_m);

// The convex hull of the points (Qhull), faces merged where coplanar, in a canonical order that
// does not depend on the order of the points; or why there is none (fewer than four points, all in
// one plane, not finite). The caller moves the vertices so that the centre of mass becomes the
// origin.
std::variant<ConvexHull, std::string> make_convex_hull(std::span<const Vec3> points_m);

}  // namespace soda::physics
