// Contacts of one solid with the triangles of a static mesh.
#pragma once

#include <span>

#include "physics/model/contact_manifold.hpp"
#include "physics/narrowphase/contact_features.hpp"

namespace soda::physics {

// Body a, or a part of it, and the mesh that b is. Refers to what it is made of.
struct MeshPair {
  const PairStep& step;
  const PlacedShape &solid, &mesh;
  const PairMotion& motion;
};

// `triangles`: indices of the triangles near the solid, ascending. Appends one manifold per
// coplanar group of triangles, in ascending order of the group's smallest triangle (its part), and
// then one for each edge that the solid touches where it touches no face.
void mesh_contacts(const MeshPair& pair, std::span<const std::uint32_t> triangles,
                   std::vector<ContactManifold>& out);

}  // namespace soda::physics
