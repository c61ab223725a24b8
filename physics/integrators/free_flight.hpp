// Bodies that touch nothing, many at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// Advances states[i] of body ids[i], for each i of `free` (ascending): the bits and the faults of
// advance_free_body() for one after the other. Manifolds are not read.
void advance_free_bodies(const IslandStep& step, std::span<const std::uint32_t> free,
                         std::span<BodyState> states, StageCounters& counters,
                         std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
