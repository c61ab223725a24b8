// Bodies that touch nothing, many at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/island_report.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// Advances states[i] of body ids[i] by dt_s, for each i of `free` (ascending): the bits and the
// faults of advance_free_body() for one after the other.
void advance_free_bodies(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                         std::span<const BodyId> ids, std::span<const std::uint32_t> free,
                         std::span<BodyState> states, StageCounters& counters,
                         std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
