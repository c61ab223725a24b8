// An island after its impacts: in closed form, in one solve, or in several to a tolerance.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// What comes after impacts: a single spring in closed form, else one such step, or as many as the
// motion wants (refinement.hpp).
IslandReport advance_resting(const IslandStep& island, std::span<BodyState> states,
                             const IslandEffects& effects);

}  // namespace soda::physics
