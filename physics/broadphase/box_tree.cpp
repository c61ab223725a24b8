#include "physics/broadphase/box_tree.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

namespace soda::physics {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
const Aabb kNothing{Vec3::Constant(kFar), Vec3::Constant(-kFar)};

Aabb around(const Aabb& a, const Aabb& b) { return {a.min.cwiseMin(b.min), a.max.cwiseMax(b.max)}; }

}  // namespace

// Halves along the longest side, so that the first is full.
void BoxTree::arrange(std::span<const Aabb> boxes, std::uint32_t begin, std::uint32_t end,
                      std::uint32_t room) {
  const std::uint32_t half = room / 2;
  if (end - begin <= half || room < 2) {
    if (half > 0) arrange(boxes, begin, end, half);
    return;
  }
  Aabb all = kNothing;
  for (std::uint32_t i = begin; i < end; ++i) all = around(all, boxes[order_[i]]);
  int axis = 0;
  for (int i = 1; i < 3; ++i)
    if (all.max[i] - all.min[i] > all.max[axis] - all.min[axis]) axis = i;
  const auto middle = [&](std::uint32_t i) { return boxes[i].min[axis] + boxes[i].max[axis]; };
  std::nth_element(order_.begin() + begin, order_.begin() + begin + half, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return middle(a) != middle(b) ? middle(a) < middle(b) : a < b;
                   });
  arrange(boxes, begin, begin + half, half);
  arrange(boxes, begin + half, end, half);
}

BoxTree::BoxTree(std::span<const Aabb> boxes) {
  const auto count = static_cast<std::uint32_t>(boxes.size());
  leaves_ = std::bit_ceil(std::max(count, 1u));
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  arrange(boxes, 0, count, leaves_);
  place_.resize(count);
  nodes_.assign(2 * std::size_t{leaves_}, kNothing);
  for (std::uint32_t i = 0; i < count; ++i) {
    place_[order_[i]] = i;
    nodes_[leaves_ + i] = boxes[order_[i]];
  }
  for (std::uint32_t i = leaves_ - 1; i > 0; --i)
    nodes_[i] = around(nodes_[2 * i], nodes_[2 * i + 1]);
}

void BoxTree::change(std::uint32_t leaf, const Aabb& box) {
  std::uint32_t node = leaves_ + place_[leaf];
  nodes_[node] = box;
  while (node /= 2) nodes_[node] = around(nodes_[2 * node], nodes_[2 * node + 1]);
}

void BoxTree::find(const Aabb& box, std::vector<std::uint32_t>& found) const {
  found.clear();
  std::uint32_t node = 1;
  for (;;) {  // in the order of places
    if (overlap(box, nodes_[node])) {
      if (node < leaves_) {
        node *= 2;
        continue;
      }
      found.push_back(order_[node - leaves_]);
    }
    while (node & 1u) node /= 2;  // the right child was the last of its parent
    if (node == 0) break;
    ++node;
  }
  std::sort(found.begin(), found.end());
}

}  // namespace soda::physics
