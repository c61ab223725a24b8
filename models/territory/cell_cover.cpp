#include "models/territory/cell_cover.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace soda::models {
namespace {

using physics::Aabb;
using physics::Vec3;

constexpr float kEndless = std::numeric_limits<float>::infinity();

float at_least(double x) {
  const auto near = static_cast<float>(x);
  return static_cast<double>(near) < x ? std::nextafter(near, kEndless) : near;
}
float at_most(double x) { return -at_least(-x); }

}  // namespace

bool CellCovers::Region::contains(const Vec3& point) const {
  return min[0] <= point[0] && point[0] <= max[0] && min[1] <= point[1] && point[1] <= max[1] &&
         min[2] <= point[2] && point[2] <= max[2];
}

CellCovers::Region CellCovers::rounded(const Aabb& box) {
  Region region{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    region.min[axis] = at_least(box.min[static_cast<Eigen::Index>(axis)]);
    region.max[axis] = at_most(box.max[static_cast<Eigen::Index>(axis)]);
  }
  return region;
}

// Where points are of that cell; nowhere if rounding, far from the origin, leaves no room for them.
// Cells at the edge of the grid go on without end.
CellCovers::Region CellCovers::inside_of(const std::array<std::int32_t, 3>& cell) const {
  constexpr double kRim = 1e-3;  // of a cell
  const Grid& grid = map_->grid();
  Aabb inside;
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = grid.origin_m[axis], size = grid.cell_size_m;
    const bool is_first = cell[axis] == 0, is_last = cell[axis] + 1 == grid.cells[axis];
    inside.min[axis] = is_first ? -kEndless : origin + (cell[axis] + kRim) * size;
    inside.max[axis] = is_last ? kEndless : origin + (cell[axis] + 1 - kRim) * size;
  }
  // Cells grow with coordinates: what lies between two points of a cell is of it, too.
  const Region region = rounded(inside);
  const auto cell_at = [&grid](const std::array<float, 3>& point) {
    return grid.cell_of(Vec3(point[0], point[1], point[2]));
  };
  return cell_at(region.min) == cell && cell_at(region.max) == cell ? region : rounded(nowhere());
}

void CellCovers::start(const std::shared_ptr<const TerritoryMap>& map, WorldId world,
                       std::size_t boxes) {
  // Lists that grow leave their old room behind.
  const bool is_wasteful = lists_.size() > 1024 + 32 * boxes;
  if (map_ != map || world_ != world || is_wasteful) {
    kept_.clear();
    lists_.clear();
  }
  map_ = map;
  world_ = world;
  if (kept_.size() < boxes)
    kept_.resize(boxes, {.lower = rounded(nowhere()), .upper = rounded(nowhere())});
}

CoveredCells CellCovers::find(std::size_t place, const Aabb& box) {
  Kept& kept = kept_[place];
  if (!kept.lower.contains(box.min) || !kept.upper.contains(box.max)) look(box, kept);
  const std::span<const std::uint32_t> list(lists_);
  return {.others = list.subspan(kept.first + kept.border_cells, kept.others),
          .border_cells = list.subspan(kept.first, kept.border_cells)};
}

bool CellCovers::keeps(std::size_t place, const Vec3& point) const {
  const Kept& kept = kept_[place];
  return kept.others == 0 && Region{kept.lower.min, kept.upper.max}.contains(point);
}

void CellCovers::look(const Aabb& box, Kept& kept) {
  const std::size_t room = std::size_t{kept.border_cells} + kept.others;
  Aabb around;
  cells_.clear();
  owners_.clear();
  if (map_->is_inland(box, world_, around)) {
    kept.lower = kept.upper = rounded(around);
  } else {
    map_->owners_of(box, owners_);
    std::erase(owners_, world_);
    map_->border_cells_of(box, world_, cells_);
    kept.lower = inside_of(map_->grid().cell_of(box.min));
    kept.upper = inside_of(map_->grid().cell_of(box.max));
  }
  const std::size_t needed = cells_.size() + owners_.size();
  if (needed > room) {
    kept.first = static_cast<std::uint32_t>(lists_.size());
    lists_.resize(lists_.size() + needed);
  }
  kept.border_cells = static_cast<std::uint32_t>(cells_.size());
  kept.others = static_cast<std::uint32_t>(owners_.size());
  auto to = std::copy(cells_.begin(), cells_.end(), lists_.begin() + kept.first);
  for (const WorldId owner : owners_) *to++ = index_of(owner);
}

}  // namespace soda::models
