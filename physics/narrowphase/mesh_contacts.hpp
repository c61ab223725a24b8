// Contacts of one solid with the triangles of a static mesh.
#pragma once

#include <span>

#include "physics/model/contact_manifold.hpp"
#include "physics/narrowphase/contact_features.hpp"

namespace soda::physics {

// `triangles`: indices of the triangles near the solid, ascending. Appends one manifold per
// coplanar group of triangles, in ascending order of the group's smallest triangle (its part), and
// then one for each edge that the solid touches where it touches no face.
void mesh_contacts(BodyId a, BodyId b, const PlacedShape& solid, const PlacedShape& mesh,
                   std::span<const std::uint32_t> triangles, const PairMotion& motion,
                   const Vec3& origin_m, std::vector<ContactManifold>& out);

}  // namespace soda::physics
