#include "physics/constraints/sweep_order.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace soda::physics {
namespace {

// Breadth first from the joint with the fewest neighbours.
class SweepOrder {
 public:
  SweepOrder(std::uint32_t count, std::span<const std::array<std::uint32_t, 2>> bodies)
      : bodies_(bodies), joints_of_(count), visited_(count, false), seen_(bodies.size(), false) {
    for (std::uint32_t joint = 0; joint < bodies.size(); ++joint)
      for_each_body(joint, [&](std::uint32_t body) { joints_of_[body].push_back(joint); });
    count_neighbours();
  }

  std::vector<std::uint32_t> find() {
    std::vector<std::uint32_t> starts(bodies_.size()), order;
    std::iota(starts.begin(), starts.end(), 0u);
    sort(starts);
    for (const std::uint32_t start : starts) {
      if (seen_[start]) continue;
      seen_[start] = true;
      order.push_back(start);
      for (std::size_t next = order.size() - 1; next < order.size(); ++next) {
        std::vector<std::uint32_t> found = unseen_beside(order[next]);
        sort(found);
        order.insert(order.end(), found.begin(), found.end());
      }
    }
    std::reverse(order.begin(), order.end());
    return order;
  }

 private:
  template <class Do>
  void for_each_body(std::uint32_t joint, const Do& visit) const {
    for (const std::uint32_t body : bodies_[joint])
      if (body < joints_of_.size()) visit(body);
  }

  // Those that share both bodies are in both lists.
  void count_neighbours() {
    neighbours_.assign(bodies_.size(), 0);
    std::vector<std::uint32_t> by_bodies(bodies_.size());
    std::iota(by_bodies.begin(), by_bodies.end(), 0u);
    std::ranges::sort(by_bodies, {}, [this](std::uint32_t joint) { return bodies_[joint]; });
    for (std::size_t first = 0, end = 0; first < by_bodies.size(); first = end) {
      const std::array<std::uint32_t, 2>& both = bodies_[by_bodies[first]];
      while (end < by_bodies.size() && bodies_[by_bodies[end]] == both) ++end;
      std::size_t beside = 0, lists = 0;
      for_each_body(by_bodies[first], [&](std::uint32_t body) {
        beside += joints_of_[body].size();
        ++lists;
      });
      if (lists == 2) beside -= end - first;
      for (std::size_t i = first; i < end; ++i) neighbours_[by_bodies[i]] = beside;
    }
  }

  std::vector<std::uint32_t> unseen_beside(std::uint32_t joint) {
    std::vector<std::uint32_t> found;
    for_each_body(joint, [&](std::uint32_t body) {
      if (visited_[body]) return;
      visited_[body] = true;
      for (const std::uint32_t other : joints_of_[body]) {
        if (!seen_[other]) found.push_back(other);
        seen_[other] = true;
      }
    });
    return found;
  }

  void sort(std::vector<std::uint32_t>& joints) const {
    std::sort(joints.begin(), joints.end(), [this](std::uint32_t x, std::uint32_t y) {
      return std::pair(neighbours_[x], x) < std::pair(neighbours_[y], y);
    });
  }

  std::span<const std::array<std::uint32_t, 2>> bodies_;
  std::vector<std::vector<std::uint32_t>> joints_of_;  // each body
  std::vector<bool> visited_;                          // of bodies: all of their joints are seen
  std::vector<bool> seen_;                             // of joints
  std::vector<std::size_t> neighbours_;                // of each joint: how many, itself counted
};

}  // namespace

std::vector<std::uint32_t> sweep_order(std::uint32_t count,
                                       std::span<const std::array<std::uint32_t, 2>> bodies) {
  if (bodies.size() == 1) return {0};
  return SweepOrder(count, bodies).find();
}

}  // namespace soda::physics
