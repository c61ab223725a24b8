// What islands that joints alone hold together will cost a step: known before a run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "physics/constraints/joint_islands.hpp"

namespace soda::models {

struct JointCost {
  physics::JointIsland island;
  bool swept = false;           // instead of factorised, where nothing touches it
  std::int64_t factors_ns = 0;  // modelled (work_cost.hpp), of its factorisations in a step
  // What all else of the scene's step costs, contacts left out, is a unit.
  double of_the_rest = 0.0;

  // Most of a step goes into the island's factorisations.
  bool is_costly() const { return of_the_rest > 1.0; }
};

// Of each island, the costliest first.
std::vector<JointCost> joint_costs(const physics::SceneDescription& scene);

// Those of them that are costly: what somebody should be warned of.
std::vector<JointCost> costly_islands(const physics::SceneDescription& scene);

// One sentence, e.g. "joints hold 200 bodies (the first has id 0) in one island: ...".
std::string words_for(const physics::SceneDescription& scene, const JointCost& cost);

}  // namespace soda::models
