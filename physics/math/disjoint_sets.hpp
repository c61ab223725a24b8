// Disjoint sets of the numbers below n: parent[i] is i itself at the root of a set.
#pragma once

#include <cstdint>
#include <vector>

namespace soda::physics {

// The root of i's set. Shortens the way there: halving, after J. van Leeuwen and T. van der Weide,
// "Alternative path compression techniques", Utrecht University RUU-CS-77-3, 1977.
inline std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace soda::physics
