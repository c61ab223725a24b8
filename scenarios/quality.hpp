// The solver's quality: one word for what else takes several settings.
#pragma once

#include "physics/model/scene.hpp"

namespace soda::scenarios {

// What a step may cost, for how small an error.
enum class Quality { kFast, kBalanced, kAccurate };

// Sets the solver's iterations, whether islands get several parts unasked, and the tolerance.
void set_quality(Quality quality, physics::SceneDescription& scene);

}  // namespace soda::scenarios
