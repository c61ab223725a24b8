// Islands at rest: what their solver cannot tell from rest is rest, and costs no solve.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

// Of what is known of contacts of bodies at rest.
Need sleeping_needed(const SceneDescription& scene);

bool has_no_velocity(const BodyState& state);

// Whether the island begins the step so slowly that it can be at rest after it. Contacts
// and joints hold it: what is driven, pushed or damped, has a motor or hangs from joints alone is
// never taken to be at rest. These are functions of their arguments only, of whole steps.
bool may_fall_asleep(const IslandStep& island, std::span<const BodyState> states);

// Whether such an island has no velocity, and the impulses that it begins with hold it: then the
// step leaves it as it is, bit for bit. Fills in `report`.
bool is_in_static_equilibrium(const IslandStep& island, std::span<const BodyState> states,
                              IslandReport& report, StageCounters& counters);

// Such an island after the step: if it is as slow as before, and in its place, it stays where it
// was `before`, without any velocity, and what statics gave is what that takes.
// The impulses found stay, and hold it from now on. Where they are those of before, too, it rests.
void fall_asleep(const IslandStep& island, std::span<const BodyState> before,
                 std::span<BodyState> states, IslandReport& report);

}  // namespace soda::physics
