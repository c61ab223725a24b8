// The triangles of a mesh that are near a solid.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/narrowphase/contact_features.hpp"

namespace soda::physics {

// Ascending. All that come within range_m of the smallest box along the solid's own axes, and some
// that do not quite. The cost is that of what is near, whatever the mesh has elsewhere.
std::vector<std::uint32_t> near_triangles(const PlacedShape& solid, const PlacedShape& mesh,
                                          double range_m);

}  // namespace soda::physics
