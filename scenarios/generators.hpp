// Bodies made by rule.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/placement.hpp"
#include "scenarios/shapes.hpp"

namespace soda::scenarios {

// Bodies that the generator makes, at most 1.1e18: not yet checked against kMaxBodies.
std::int64_t count_of(const GeneratorSpec& spec);

// Starting states, in the order of ids. `spec` is sound and its count allowed. `taken`: bounding
// spheres of the bodies made before. `seed` replaces that of the file. A region that is full is a
// fault; the states are then fewer.
std::vector<physics::BodyState> generate(const GeneratorSpec& spec, const PlacedShape& shape,
                                         std::span<const BoundingSphere> taken,
                                         std::optional<std::uint64_t> seed, FaultList& faults);

}  // namespace soda::scenarios
