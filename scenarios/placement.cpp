#include "scenarios/placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace soda::scenarios {
namespace {

using physics::Vec3;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// Spheres by the cell of their centre. Cells are at least as wide as `reach`, the largest distance
// at which two spheres can be too close, so that neighbours lie in the 27 cells around.
class SphereGrid {
 public:
  SphereGrid(const physics::Aabb& box, double reach, std::size_t expected) : box_(box) {
    const Vec3 size(box.max - box.min);
    // No more cells than spheres along the cube root: finer ones would only cost memory.
    const double most = std::ceil(std::cbrt(static_cast<double>(expected))) + 1.0;
    for (int i = 0; i < 3; ++i) {
      const double fitting = reach > 0.0 ? std::floor(size[i] / reach) : most;
      cells_[i] = static_cast<std::int64_t>(std::clamp(fitting, 1.0, most));
      width_m_[i] = size[i] / static_cast<double>(cells_[i]);
    }
    heads_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]), kNone);
  }

  void add(const BoundingSphere& sphere) {
    std::uint32_t& head = heads_[index_of(cell_of(sphere.center_m))];
    next_.push_back(head);
    head = static_cast<std::uint32_t>(spheres_.size());
    spheres_.push_back(sphere);
  }

  bool is_free(const BoundingSphere& wanted, double gap_m) const {
    const auto cell = cell_of(wanted.center_m);
    std::array<std::int64_t, 3> c{};
    for (c[2] = first(cell, 2); c[2] <= last(cell, 2); ++c[2]) {
      for (c[1] = first(cell, 1); c[1] <= last(cell, 1); ++c[1]) {
        for (c[0] = first(cell, 0); c[0] <= last(cell, 0); ++c[0]) {
          if (!is_free_in(index_of(c), wanted, gap_m)) return false;
        }
      }
    }
    return true;
  }

 private:
  std::array<std::int64_t, 3> cell_of(const Vec3& p) const {
    std::array<std::int64_t, 3> cell{};
    for (int i = 0; i < 3; ++i) {
      const double at = width_m_[i] > 0.0 ? std::floor((p[i] - box_.min[i]) / width_m_[i]) : 0.0;
      cell[i] = static_cast<std::int64_t>(std::clamp(at, 0.0, static_cast<double>(cells_[i] - 1)));
    }
    return cell;
  }
  std::size_t index_of(const std::array<std::int64_t, 3>& c) const {
    return static_cast<std::size_t>((c[2] * cells_[1] + c[1]) * cells_[0] + c[0]);
  }
  std::int64_t first(const std::array<std::int64_t, 3>& c, int i) const {
    return std::max<std::int64_t>(c[i] - 1, 0);
  }
  std::int64_t last(const std::array<std::int64_t, 3>& c, int i) const {
    return std::min(c[i] + 1, cells_[i] - 1);
  }
  bool is_free_in(std::size_t cell, const BoundingSphere& wanted, double gap_m) const {
    for (std::uint32_t i = heads_[cell]; i != kNone; i = next_[i]) {
      const double dx = spheres_[i].center_m.x() - wanted.center_m.x();
      const double dy = spheres_[i].center_m.y() - wanted.center_m.y();
      const double dz = spheres_[i].center_m.z() - wanted.center_m.z();
      const double least = spheres_[i].radius_m + wanted.radius_m + gap_m;
      if (dx * dx + dy * dy + dz * dz < least * least) return false;
    }
    return true;
  }

  physics::Aabb box_;
  Vec3 width_m_ = Vec3::Zero();
  std::array<std::int64_t, 3> cells_{1, 1, 1};
  std::vector<std::uint32_t> heads_, next_;
  std::vector<BoundingSphere> spheres_;
};

bool within(const physics::Aabb& box, const Vec3& p) { return physics::overlap(box, {p, p}); }

}  // namespace

std::vector<Vec3> place_spheres(std::size_t count, double radius_m, double gap_m,
                                const physics::Aabb& region,
                                std::span<const BoundingSphere> obstacles, RandomStream& stream) {
  double widest = radius_m;
  for (const BoundingSphere& o : obstacles) widest = std::max(widest, o.radius_m);
  const double reach = widest + radius_m + gap_m;
  const Vec3 margin(reach, reach, reach);
  const physics::Aabb around{region.min - margin, region.max + margin};

  SphereGrid grid(around, reach, count + obstacles.size());
  for (const BoundingSphere& o : obstacles) {
    if (within(around, o.center_m)) grid.add(o);
  }
  std::vector<Vec3> centers;
  for (int draws = 0; centers.size() < count && draws < kMaxDraws; ++draws) {
    const double x = uniform(stream, region.min.x(), region.max.x());
    const double y = uniform(stream, region.min.y(), region.max.y());
    const double z = uniform(stream, region.min.z(), region.max.z());
    const BoundingSphere wanted{Vec3(x, y, z), radius_m};
    if (!grid.is_free(wanted, gap_m)) continue;
    grid.add(wanted);
    centers.push_back(wanted.center_m);
    draws = -1;  // the next one has all its draws
  }
  return centers;
}

}  // namespace soda::scenarios
