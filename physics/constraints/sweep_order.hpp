// The order in which the joints of an island are swept.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace soda::physics {

// From neighbour to neighbour: reverse Cuthill-McKee (ACM National Conference 1969). Of each place
// the joint. `bodies` of each joint are below `count`; by the world, which is not, joints are no
// neighbours.
std::vector<std::uint32_t> sweep_order(std::uint32_t count,
                                       std::span<const std::array<std::uint32_t, 2>> bodies);

}  // namespace soda::physics
