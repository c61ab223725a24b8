// Territories as in the paper's experiments: of equal size in bodies first, then in cells, with
// ragged borders.
#pragma once

#include <cstdint>
#include <span>

#include "models/territory/territory.hpp"

namespace soda::models {

// Two clusterings of equal size, by Manhattan distance over x and y; a cluster is a world.
// 1. Of the bodies, by k-means with 12 iterations from bodies drawn by `seed`. Clusters are filled
//    one after the other, each with the bodies that are nearest to its centre and still free.
// 2. Of the columns of cells about the centres of these clusters, the nearest first, until each
//    has its share.
// Shares differ by one at most. The last columns go where there is room, so territories come in
// pieces with ragged borders, which do not keep away from bodies as those of MapKind::kKMeans do.
// Every world has a column; with fewer columns than worlds the map is one of blocks.
// `body_positions_m`: initial centres, at least one.
TerritoryMap make_paper_map(const Grid& grid, std::uint32_t worlds, std::uint64_t seed,
                            std::span<const physics::Vec3> body_positions_m);

}  // namespace soda::models
