// Faces of statics that a point comes through.
#pragma once

#include <optional>

#include "physics/shapes/compiled_shape.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// The face of a static, as a plane in the world, that a point which goes straight from one place to
// another passes first, or that it ends nearer to than the clearance, over it. None of a box or a
// hull that it began in, of a mesh from behind, of round shapes. Of a
// compound, that of its first part that has one.
std::optional<FacePlane> face_passed(const Geometry& geometry, BodyId fixed, const Vec3& from_m,
                                     const Vec3& to_m, double clearance_m);

}  // namespace soda::physics
