// How kinematic bodies move.
#pragma once

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// After t_s >= 0: by its velocities alone, and not at all if it has none. Without its impulses.
BodyState carried(const SceneDescription& scene, BodyId id, const BodyState& state, double t_s);

}  // namespace soda::physics
