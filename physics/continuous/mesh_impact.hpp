// When a body in free flight touches a mesh.
#pragma once

#include <optional>
#include <vector>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/shapes/compiled_shape.hpp"

namespace soda::physics {

// As time_of_impact(), where b is a mesh; of a compound, that of this part. Triangles push to their
// front: what reaches one while its centre is behind it does not touch it.
// Only triangles along the path are looked at, by the time at which the ball around the body can
// come to them.
std::optional<Impact> time_of_mesh_impact(const PairStep& pair, std::uint32_t part_a);

// See append_distance_to_impact().
void append_distance_to_mesh(const PairStep& pair, std::uint32_t part_a,
                             std::vector<ContactManifold>& out);

// The face of a mesh that a point which goes straight comes nearer to from its front than the
// clearance, first; in the world frame.
std::optional<FacePlane> mesh_face_passed(const Geometry& geometry, BodyId mesh, const Vec3& from_m,
                                          const Vec3& to_m, double clearance_m);

}  // namespace soda::physics
