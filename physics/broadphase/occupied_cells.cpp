#include "physics/broadphase/occupied_cells.hpp"

#include <algorithm>

namespace soda::physics {

OccupiedCells::OccupiedCells(std::span<const Aabb> boxes) : rows_(kCells * kCells, 0) {
  constexpr double kWider = 1.0 + 1e-9;  // rounding of middles
  constexpr double kMost = 2.0;          // of the widest box
  if (boxes.empty()) return;
  Aabb all = boxes.front();
  for (const Aabb& box : boxes) {
    half_m_ = std::max(half_m_, kMost * 0.5 * (box.max - box.min).maxCoeff());
    all = {all.min.cwiseMin(box.min), all.max.cwiseMax(box.max)};
  }
  const Vec3 beyond =
      Vec3::Constant(half_m_ * kWider) + all.min.cwiseAbs().cwiseMax(all.max.cwiseAbs()) * 1e-9;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent_m = all.max[axis] - all.min[axis] + 2.0 * beyond[axis];
    least_m_[axis] = all.min[axis] - beyond[axis];
    cells_1_m_[axis] = extent_m > 0.0 ? static_cast<double>(kCells) / extent_m : 0.0;
  }
  for (const Aabb& box : boxes) {
    const Vec3 min = box.min - beyond, max = box.max + beyond;
    const std::uint32_t from = cell_of(0, min.x()), to = cell_of(0, max.x());
    const std::uint64_t row = ~std::uint64_t{0} >> (kCells - 1 - (to - from)) << from;
    for (std::uint32_t k = cell_of(2, min.z()); k <= cell_of(2, max.z()); ++k)
      for (std::uint32_t j = cell_of(1, min.y()); j <= cell_of(1, max.y()); ++j)
        rows_[kCells * k + j] |= row;
  }
}

}  // namespace soda::physics
