#include "scenarios/quality.hpp"

namespace soda::scenarios {

void set_quality(Quality quality, physics::SceneDescription& scene) {
  scene.solver.iterations = physics::SolverSettings{}.iterations;
  scene.solver.refined = quality != Quality::kFast;
  scene.tolerance = 0.0;
  if (quality == Quality::kFast) scene.solver.iterations = 24;
  if (quality != Quality::kAccurate) return;
  scene.solver.iterations = 60;
  scene.tolerance = 1e-6;
}

}  // namespace soda::scenarios
