// Whether a box can overlap any of some others, for very many of it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::physics {

// The room around some boxes in cells, each of them with one of the boxes near it or none. Boxes
// need not be finite. A function of the boxes.
class OccupiedCells {
 public:
  explicit OccupiedCells(std::span<const Aabb> boxes);

  // True for all that overlap one of the boxes, for few others that are at most twice as wide as
  // the widest of these, and for what is wider.
  bool may_overlap(const Aabb& box) const {
    const Vec3 middle = 0.5 * (box.min + box.max);
    for (int axis = 0; axis < 3; ++axis)  // also for what is no number
      if (!(box.max[axis] - middle[axis] <= half_m_)) return true;
    return (rows_[kCells * cell_of(2, middle.z()) + cell_of(1, middle.y())] >>
                cell_of(0, middle.x()) &
            1u) != 0;
  }

 private:
  static constexpr std::uint32_t kCells = 64;  // along each axis

  std::uint32_t cell_of(int axis, double at_m) const {
    const double cell = (at_m - least_m_[axis]) * cells_1_m_[axis];
    return cell > 0.0 ? cell < kCells - 1 ? static_cast<std::uint32_t>(cell) : kCells - 1 : 0;
  }

  double half_m_ = 0.0;  // of what is looked up
  Vec3 least_m_ = Vec3::Zero(), cells_1_m_ = Vec3::Zero();
  std::vector<std::uint64_t> rows_;  // along x
};

}  // namespace soda::physics
