// Initial territories that follow the static environment: borders where nothing can pass.
#pragma once

#include "models/territory/territory.hpp"
#include "physics/model/scene.hpp"

namespace soda::models {

// Recursive bisection of the grid into boxes, as for MapKind::kBlocks, but by the cells in which
// there is room for bodies, and cut where the fewest of them can be left across the cut. A cell has
// no room if its centre lies in a static box; a face is closed if the line between the centres of
// its cells meets one. Other static shapes are not looked at. Cuts may be off balance by a quarter.
TerritoryMap make_static_map(const Grid& grid, std::uint32_t worlds,
                             const physics::SceneDescription& scene);

}  // namespace soda::models
