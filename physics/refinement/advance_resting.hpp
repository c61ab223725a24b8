// An island after its impacts: in closed form, in one solve, or in several to a tolerance.
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

// What comes after impacts: a lone spring in closed form, else one such step, or as many as the
// motion wants (refinement.hpp).
IslandReport advance_resting(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds,
                             std::span<BodyState> states, SolveScratch& scratch,
                             StageCounters& counters, std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
