// Large islands whose whole step is one solve, which worlds can share.
#pragma once

#include <optional>
#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_step.hpp"
#include "physics/solvers/island_blocks.hpp"

namespace soda::physics {

// Whether the whole step of an island that is large is one such solve, not accurate: nothing flies
// through impacts, nothing is refined, and it does not fall apart into islands that are none
// (advance_apart.hpp).
bool is_one_solve(const IslandStep& island, std::span<const BodyState> states);

// The blocks in which advance_island solves an island, if it does. Only large islands have any, and
// none whose bodies have joints: that one is lost is to be seen of the whole.
std::optional<IslandBlocks> blocks_of_step(const IslandStep& island,
                                           std::span<const BodyState> states);

}  // namespace soda::physics
