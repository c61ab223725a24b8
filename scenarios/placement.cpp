#include "scenarios/placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace soda::scenarios {
namespace {

using physics::Vec3;

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

bool too_close(const BoundingSphere& a, const BoundingSphere& b, double gap_m) {
  const double dx = a.center_m.x() - b.center_m.x();
  const double dy = a.center_m.y() - b.center_m.y();
  const double dz = a.center_m.z() - b.center_m.z();
  const double least = a.radius_m + b.radius_m + gap_m;
  return dx * dx + dy * dy + dz * dz < least * least;
}

// Spheres by the cell of their centre. Cells are at least as wide as `reach`, the largest distance
// at which two spheres can be too close.
class SphereGrid {
 public:
  SphereGrid(const physics::Aabb& box, double reach, std::size_t expected)
      : box_(box), sought_m_(kBeyondRounding * reach) {
    const Vec3 size(box.max - box.min);
    Vec3 wanted(std::floor(size.x() / reach), std::floor(size.y() / reach),
                std::floor(size.z() / reach));
    // Many more cells than spheres would only cost memory.
    const double most = 4.0 * static_cast<double>(expected) + 64.0;
    while (wanted.x() * wanted.y() * wanted.z() > most) {
      int longest = wanted.x() >= wanted.y() ? 0 : 1;
      if (wanted.z() > wanted[longest]) longest = 2;
      wanted[longest] = std::ceil(0.5 * wanted[longest]);
    }
    for (int i = 0; i < 3; ++i) {
      cells_[i] = static_cast<std::int64_t>(std::max(wanted[i], 1.0));
      width_m_[i] = size[i] / static_cast<double>(cells_[i]);
    }
    heads_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]), kNobody);
    next_.reserve(expected);
    spheres_.reserve(expected);
  }

  void add(const BoundingSphere& sphere) {
    std::uint32_t& head = heads_[index_of(cell_of(sphere.center_m))];
    next_.push_back(head);
    head = static_cast<std::uint32_t>(spheres_.size());
    spheres_.push_back(sphere);
  }

  bool is_free(const BoundingSphere& wanted, double gap_m) const {
    const Vec3 sought(sought_m_, sought_m_, sought_m_);
    const auto first = cell_of(wanted.center_m - sought), last = cell_of(wanted.center_m + sought);
    std::array<std::int64_t, 3> c{};
    for (c[2] = first[2]; c[2] <= last[2]; ++c[2]) {
      for (c[1] = first[1]; c[1] <= last[1]; ++c[1]) {
        for (c[0] = first[0]; c[0] <= last[0]; ++c[0]) {
          if (!is_free_in(index_of(c), wanted, gap_m)) return false;
        }
      }
    }
    return true;
  }

 private:
  static constexpr double kBeyondRounding = 1.01;

  std::array<std::int64_t, 3> cell_of(const Vec3& p) const {
    std::array<std::int64_t, 3> cell{};
    for (int i = 0; i < 3; ++i) {
      const double at = width_m_[i] > 0.0 ? (p[i] - box_.min[i]) / width_m_[i] : 0.0;
      cell[i] = static_cast<std::int64_t>(std::clamp(at, 0.0, static_cast<double>(cells_[i] - 1)));
    }
    return cell;
  }
  std::size_t index_of(const std::array<std::int64_t, 3>& c) const {
    return static_cast<std::size_t>((c[2] * cells_[1] + c[1]) * cells_[0] + c[0]);
  }
  bool is_free_in(std::size_t cell, const BoundingSphere& wanted, double gap_m) const {
    for (std::uint32_t i = heads_[cell]; i != kNobody; i = next_[i]) {
      if (too_close(spheres_[i], wanted, gap_m)) return false;
    }
    return true;
  }

  physics::Aabb box_;
  double sought_m_;
  Vec3 width_m_ = Vec3::Zero();
  std::array<std::int64_t, 3> cells_{1, 1, 1};
  std::vector<std::uint32_t> heads_, next_;
  std::vector<BoundingSphere> spheres_;
};

// Obstacles that can matter, apart by size: a few large ones must not coarsen the grid.
struct Obstacles {
  std::vector<BoundingSphere> small, large;
};

Obstacles obstacles_near(const physics::Aabb& region, double radius_m, double gap_m,
                         std::span<const BoundingSphere> obstacles) {
  Obstacles near;
  for (const BoundingSphere& o : obstacles) {
    const double reach = o.radius_m + radius_m + gap_m;
    const Vec3 margin(reach, reach, reach);
    if (!physics::overlap(region, {o.center_m - margin, o.center_m + margin})) continue;
    (o.radius_m <= 4.0 * radius_m ? near.small : near.large).push_back(o);
  }
  return near;
}

}  // namespace

std::vector<Vec3> place_spheres(std::size_t count, double radius_m, double gap_m,
                                const physics::Aabb& region,
                                std::span<const BoundingSphere> obstacles, RandomStream& stream) {
  const Obstacles near = obstacles_near(region, radius_m, gap_m, obstacles);
  double widest = radius_m;
  for (const BoundingSphere& o : near.small) widest = std::max(widest, o.radius_m);
  const double reach = widest + radius_m + gap_m;
  const Vec3 margin(reach, reach, reach);
  SphereGrid grid({region.min - margin, region.max + margin}, reach, count + near.small.size());
  for (const BoundingSphere& o : near.small) grid.add(o);
  std::vector<Vec3> centers;
  centers.reserve(count);
  for (int draws = 0; centers.size() < count && draws < kMaxDraws; ++draws) {
    const double x = uniform(stream, region.min.x(), region.max.x());
    const double y = uniform(stream, region.min.y(), region.max.y());
    const double z = uniform(stream, region.min.z(), region.max.z());
    const BoundingSphere wanted{Vec3(x, y, z), radius_m};
    const auto hits = [&](const BoundingSphere& o) { return too_close(o, wanted, gap_m); };
    if (!grid.is_free(wanted, gap_m) || std::any_of(near.large.begin(), near.large.end(), hits)) {
      continue;
    }
    grid.add(wanted);
    centers.push_back(wanted.center_m);
    draws = -1;  // the next one has all its draws
  }
  return centers;
}

}  // namespace soda::scenarios
