// Islands whose contacts do not all hold something: what is not held together is advanced apart.
#pragma once

#include <span>
#include <vector>

#include "physics/broadphase/islands.hpp"
#include "physics/integrators/end_contacts.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// Whether the contacts of two bodies hold something: they pressed in the step before, close within
// dt_s, or overlap by what is to be pushed apart.
bool holds(const SceneDescription& scene, const Geometry& geometry, double dt_s,
           const ContactManifold& m, const BodyState& a, const BodyState& b);

// The islands that are left where contacts between bodies are taken away that hold nothing. No more
// than one: nothing to take away, or the scene asks for a tolerance, or a joint is among the
// manifolds.
Islands islands_apart(const IslandStep& island, std::span<const BodyState> states,
                      std::vector<ContactManifold>& kept);

// Whether contacts that were taken away have kept their gaps over the whole motion `move`, at the
// points of the start and, of what has turned, at those that have come round; and whether what
// links connect has not met.
bool stayed_apart(const IslandStep& island, const Islands& islands, const IslandMove& move,
                  StageCounters& counters);

}  // namespace soda::physics
