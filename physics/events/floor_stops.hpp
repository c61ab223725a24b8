// Floors that contacts do not keep a body from within the step.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// Contacts keep the points of the step's start from a halfspace: what turns by many radians can
// roll through it, and what others press or push out can pass it. The centre of mass of a convex
// body is at least a quarter of its width above any plane that it lies on; where it comes to be
// below a fifth of it, and lower than at the start, it is put there and goes down no more. What
// that lifts is added to the report as work of position correction, and what the halfspace gave; it
// is beyond any tolerance. The same holds for the faces of meshes that the centre passes or comes
// to lie over. Bodies with joints are left out: to lift one of them opens its joints. Not called
// for large islands, and not for what flies through impacts for the whole step. `before`: the
// island at the start of the step; impulses are not read.
void stop_at_floors(const IslandStep& island, std::span<const BodyState> before,
                    std::span<BodyState> states, IslandReport& report);

}  // namespace soda::physics
