// What happens at one moment of impact: velocities change, places do not.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

// Solves what touches, all at once: points that approach faster than the restitution threshold
// bounce, others are held, with friction. `ids` ascending; `manifolds` in canonical order hold the
// points that touch, with no gap left. Stored impulses have no part in it and stay. What statics
// gave, iterations and penetration are added to `report`. Returns whether a velocity changed.
bool resolve_impact(const SceneDescription& scene, std::span<const BodyId> ids,
                    std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                    IslandReport& report, StageCounters& counters);

}  // namespace soda::physics
