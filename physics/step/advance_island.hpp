// One island over one step: the interface behind which solvers are exchanged.
#pragma once

#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

struct SolveScratch;

// Advances the bodies of one island by one step: external forces, contacts, pose. `ids` ascending,
// `states[i]` belongs to ids[i], `manifolds` (canonical order, found at these states) connect them
// with each other and with statics. A function of these arguments only; `scratch` is memory. Faults
// are appended (speculative: never throws).
IslandReport advance_island(const SceneDescription& scene, const Geometry& geometry,
                            std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                            std::span<BodyState> states, SolveScratch& scratch,
                            StageCounters& counters, std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
