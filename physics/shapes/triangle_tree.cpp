#include "physics/shapes/triangle_tree.hpp"

#include <algorithm>
#include <numeric>

namespace soda::physics {
namespace {

constexpr std::uint32_t kLeaf = 4;

Aabb around(std::span<const std::array<Vec3, 3>> corners_m, std::span<const std::uint32_t> ids) {
  Aabb box{Vec3::Constant(1e300), Vec3::Constant(-1e300)};
  for (const std::uint32_t id : ids) {
    for (const Vec3& corner : corners_m[id]) {
      box.min = box.min.cwiseMin(corner);
      box.max = box.max.cwiseMax(corner);
    }
  }
  return box;
}

int longest_axis(std::span<const std::array<Vec3, 3>> corners_m,
                 std::span<const std::uint32_t> ids) {
  Vec3 low = Vec3::Constant(1e300), high = -low;
  for (const std::uint32_t id : ids) {
    const Vec3 sum = corners_m[id][0] + corners_m[id][1] + corners_m[id][2];
    low = low.cwiseMin(sum);
    high = high.cwiseMax(sum);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  return axis;
}

}  // namespace

TriangleTree::TriangleTree(std::span<const std::array<Vec3, 3>> corners_m)
    : order_(corners_m.size()) {
  if (corners_m.empty()) return;
  std::iota(order_.begin(), order_.end(), 0u);
  struct Todo {
    std::uint32_t first, count;
    std::int64_t closes = -1;  // else: the node that is complete now
  };
  std::vector<Todo> todo{{0, static_cast<std::uint32_t>(order_.size())}};
  while (!todo.empty()) {
    const Todo next = todo.back();
    todo.pop_back();
    if (next.closes >= 0) {
      nodes_[static_cast<std::size_t>(next.closes)].next =
          static_cast<std::uint32_t>(nodes_.size());
      continue;
    }
    const std::span<std::uint32_t> ids = std::span(order_).subspan(next.first, next.count);
    const std::int64_t node = static_cast<std::int64_t>(nodes_.size());
    nodes_.push_back({around(corners_m, ids), next.first, 0, 0});
    todo.push_back({0, 0, node});
    if (next.count <= kLeaf) {
      nodes_.back().count = next.count;
      continue;
    }
    const int axis = longest_axis(corners_m, ids);
    const auto middle = [&](std::uint32_t t) {
      return corners_m[t][0][axis] + corners_m[t][1][axis] + corners_m[t][2][axis];
    };
    const std::uint32_t half = next.count / 2;
    std::nth_element(ids.begin(), ids.begin() + half, ids.end(),
                     [&](std::uint32_t x, std::uint32_t y) {
                       const double at_x = middle(x), at_y = middle(y);
                       return at_x != at_y ? at_x < at_y : x < y;
                     });
    todo.push_back({next.first + half, next.count - half});
    todo.push_back({next.first, half});
  }
}

}  // namespace soda::physics
