#include "analysis/accuracy/engine.hpp"

namespace soda::analysis {

std::vector<EngineKind> engine_kinds() { return {soda_engine()}; }

std::vector<MissingEngine> missing_engines() {
  return {{"bullet", "libbullet-dev"}, {"ode", "libode-dev"}, {"mujoco", "libmujoco-dev"}};
}

}  // namespace soda::analysis
