// Statics that a body was not seen to reach when its contacts were looked for.
#pragma once

#include <span>

#include "physics/geometry.hpp"

namespace soda::physics {

// Contacts are looked for along the motion that a step begins with. Where contacts gave a body
// another one, by half its width or more, it may come to statics that it has no manifold with: it
// stops where it touches the first, with the velocity that its energy leaves it there, and the next
// step does the rest. `before`: the island at the start of the step; impulses are not read. Meshes
// are left out, and bodies with joints (these: linked_step.hpp). Counts what it looks at as
// impact_searches.
void stop_at_unseen_statics(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                            std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                            std::span<const BodyState> before, std::span<BodyState> states,
                            StageCounters& counters);

}  // namespace soda::physics
