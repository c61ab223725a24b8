// What the joints of a scene alone make islands of, and what solving each of them takes.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/model/scene.hpp"

namespace soda::physics {

struct JointIsland {
  std::vector<BodyId> bodies;  // ascending
  std::uint32_t joints = 0, rows = 0;
  std::uint64_t multiplications = 0;  // of one factorisation (joint_rows.hpp), up to 1e9
};

// Bodies without joints are in none; contacts can make one of several. Ascending by first body.
std::vector<JointIsland> joint_islands(const SceneDescription& scene);

}  // namespace soda::physics
