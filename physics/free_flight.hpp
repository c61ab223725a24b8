// Bodies that touch nothing, many at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/advance.hpp"
#include "physics/geometry.hpp"

namespace soda::physics {

// Advances states[i] of body ids[i] by dt_s, for each i of `free` (ascending): the bits and the
// faults of advance_free_body() for one after the other.
void advance_free_bodies(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                         std::span<const BodyId> ids, std::span<const std::uint32_t> free,
                         std::span<BodyState> states, StageCounters& counters,
                         std::vector<AdvanceFault>& faults);

// Whether the body spins at a constant rate, and nothing but gravity ever acts on it in flight.
bool flies_simply(const BodyParams& params);

}  // namespace soda::physics
