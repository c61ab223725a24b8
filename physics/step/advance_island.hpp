// One island over one step: the interface behind which solvers are exchanged.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// Advances the bodies of one island by one whole step (whole_step()): external forces, contacts,
// pose. The manifolds, found at these states, connect the bodies with each other and with statics.
// A function of island and states only. Faults are appended (speculative: never throws).
IslandReport advance_island(const IslandStep& island, std::span<BodyState> states,
                            const IslandEffects& effects);

}  // namespace soda::physics
