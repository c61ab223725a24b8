// Islands in flight: their impacts one after the other, each where and when it happens.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

Need flights_needed(const SceneDescription& scene);

// Whether an island is of the kind that flies: something bounces or comes far in a step, no joint,
// drive or force has a part in it, and nothing rests.
bool is_in_flight(const IslandStep& island, std::span<const BodyState> states);

// Advances the bodies of an island by at most dt_s, for as long as nothing in it lasts: no body
// rests on another, rolls or slides. Between impacts bodies fly freely (exactly), at an impact the
// velocities of its two bodies change by Newton's restitution and Coulomb friction at the points
// that touch. All pairs of the island are looked at, also those that no manifold connects, and all
// statics that its bodies can reach. Returns how far it came: 0, and nothing changed, if the island
// is not in flight; less than dt_s if something comes to rest on something then, meets it again
// without bouncing and with nothing in between, or bounces on too often. What statics gave is added
// to `report`. A function of the arguments only.
double fly_through_impacts(const IslandStep& island, std::span<BodyState> states,
                           IslandReport& report, StageCounters& counters);

}  // namespace soda::physics
