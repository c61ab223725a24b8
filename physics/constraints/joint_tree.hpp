// What hangs on what in an island of joints: bodies with many arms.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace soda::physics {

// Instead of a body: the world, or what is kinematic. Also: none.
inline constexpr std::uint32_t kImmovable = std::numeric_limits<std::uint32_t>::max();
using JointEnds = std::array<std::uint32_t, 2>;  // local indices of bodies, or kImmovable

// An arm of a body is a joint that is the only way to what hangs on it, which is not held by the
// world. A body with many arms is a hub.
struct JointTree {
  std::vector<std::uint32_t> hubs;        // local indices of bodies; what hangs on others first
  std::vector<std::uint32_t> hub_of;      // of each body: an index into hubs, or kImmovable
  std::vector<std::uint32_t> hub_of_arm;  // of each joint: an index into hubs, or kImmovable
  // Of each joint: the hub on which it hangs, itself or with what it holds; else hubs.size().
  std::vector<std::uint32_t> hangs_on;
};

JointTree joint_tree(std::span<const JointEnds> ends);

}  // namespace soda::physics
