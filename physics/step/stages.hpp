// All stages of a step: what a scene needs of each, and what counts its work.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "physics/model/need.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

struct Stage {
  std::string name;  // e.g. "friction rows"
  Need need;
  std::function<std::uint64_t(const StageCounters&)> count;  // 0 if it is not needed
};

// Two kinds of shapes that can meet in a scene, and who tests them; of compounds, those of parts.
struct ShapePair {
  std::string first, second;  // e.g. "box" and "halfspace"
  ShapeKernel kernel{};
  bool by_fcl = false;  // FCL says along which direction they meet
};
// Each once, in the order of Shape's alternatives.
std::vector<ShapePair> shape_pairs(const SceneDescription& scene);

// Of a scene whose bodies' materials are the roughest and springiest that they can get in the run.
std::vector<Stage> stages_of(const SceneDescription& scene);

}  // namespace soda::physics
