// Statics that contacts do not keep a body from within the step.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

Need unseen_statics_needed(const SceneDescription& scene);

// Contacts are looked for along the motion that a step begins with. Where contacts gave a body
// another one, by more than the margin that contacts are kept for, it may come to statics that it
// has no manifold with: it stops where it touches the first, with the velocity that its energy
// leaves it there, and the next step does the rest. `before`: the island at the start of the step;
// impulses are not read. Bodies with joints are left out (these: linked_step.hpp). The
// report gets what the static gave. Counts what it looks at as unseen_searches.
void stop_at_unseen_statics(const IslandStep& island, std::span<const BodyState> before,
                            std::span<BodyState> states, IslandReport& report,
                            StageCounters& counters);

// Contacts keep the points of the step's start from a halfspace: what turns by many radians can
// roll through it, and what others press or push out can pass it. The centre of mass of a convex
// body is at least a quarter of its width above any plane that it lies on; where it comes to be
// below a fifth of it, and lower than at the start, it is put there and goes down no more. What
// that lifts is added to the report as work of position correction, and what the halfspace gave; it
// is beyond any tolerance. The same holds for the faces of meshes that the centre passes or comes
// to lie over. Bodies with joints are left out: to lift one of them opens its joints. Not called
// for large islands, and not for what flies through impacts for the whole step. `before`: as above.
void stop_at_floors(const IslandStep& island, std::span<const BodyState> before,
                    std::span<BodyState> states, IslandReport& report);

}  // namespace soda::physics
