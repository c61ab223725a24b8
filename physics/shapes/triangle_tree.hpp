// Which triangles of a mesh are near something: a tree of boxes in the mesh's frame.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::physics {

// Boxes around halves of halves, down to a few triangles. A function of the corners alone.
class TriangleTree {
 public:
  TriangleTree() = default;
  explicit TriangleTree(std::span<const std::array<Vec3, 3>> corners_m);

  // Calls visit(triangle) for all in leaves whose box, and every box around it, has reaches(box).
  // In the order of the tree: sort what has to be in that of the triangles.
  template <class Reaches, class Visit>
  void visit(const Reaches& reaches, const Visit& visit) const {
    std::uint32_t node = 0;
    while (node < nodes_.size()) {
      const Node& n = nodes_[node];
      if (!reaches(n.box)) {
        node = n.next;
        continue;
      }
      for (std::uint32_t i = 0; i < n.count; ++i) visit(order_[n.first + i]);
      ++node;
    }
  }

 private:
  // A node is followed by all that is below it.
  struct Node {
    Aabb box;
    std::uint32_t first = 0, count = 0;  // triangles of a leaf; none of others
    std::uint32_t next = 0;              // behind all that is below
  };
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace soda::physics
