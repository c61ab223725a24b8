// Boxes of which some change all the time, and which of them a box overlaps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::physics {

// A binary tree whose leaves stay where the boxes given at first put them: a changed box changes
// the boxes above it only. What is found is a function of the boxes as they are, not of the tree.
class BoxTree {
 public:
  explicit BoxTree(std::span<const Aabb> boxes);

  const Aabb& box(std::uint32_t leaf) const { return nodes_[leaves_ + place_[leaf]]; }
  void change(std::uint32_t leaf, const Aabb& box);
  // Those that overlap it, ascending. `found` is overwritten.
  void find(const Aabb& box, std::vector<std::uint32_t>& found) const;

 private:
  void arrange(std::span<const Aabb> boxes, std::uint32_t begin, std::uint32_t end,
               std::uint32_t room);

  std::uint32_t leaves_ = 1;                  // a power of two
  std::vector<std::uint32_t> order_, place_;  // leaf to index, and back
  std::vector<Aabb> nodes_;                   // 1: the root; children of i: 2 i and 2 i + 1
};

}  // namespace soda::physics
