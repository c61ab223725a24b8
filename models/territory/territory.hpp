// Territories: the uniform grid of cells that divides space, and which world owns which cell.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "physics/model/ids.hpp"
#include "physics/model/scene.hpp"

namespace soda::models {

enum class WorldId : std::uint32_t {};
constexpr std::uint32_t index_of(WorldId id) { return static_cast<std::uint32_t>(id); }

// A box that holds nothing.
inline physics::Aabb nowhere() {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  return {physics::Vec3::Constant(kFar), physics::Vec3::Constant(-kFar)};
}
inline bool contains(const physics::Aabb& outer, const physics::Aabb& inner) {
  return outer.min.x() <= inner.min.x() && inner.max.x() <= outer.max.x() &&
         outer.min.y() <= inner.min.y() && inner.max.y() <= outer.max.y() &&
         outer.min.z() <= inner.min.z() && inner.max.z() <= outer.max.z();
}

// A box of cells x cells y cells z cubic cells. Cells are half-open; what lies outside the box
// belongs to the nearest cell, so the grid covers all of space.
struct Grid {
  physics::Vec3 origin_m = physics::Vec3::Zero();  // the corner of cell (0, 0, 0)
  double cell_size_m = 1.0;                        // > 0
  std::array<std::int32_t, 3> cells{1, 1, 1};      // each >= 1

  std::size_t cell_count() const;
  // Clamped to the grid; x, y and z independently monotone in the point's coordinates.
  std::array<std::int32_t, 3> cell_of(const physics::Vec3& point) const;
  std::size_t index_of_cell(const std::array<std::int32_t, 3>& cell) const;
};

// A cell changes hands. `to` < the map's worlds, `cell` < its cells.
struct CellTransfer {
  std::uint32_t cell = 0;  // Grid::index_of_cell
  WorldId to{};
  friend constexpr auto operator<=>(const CellTransfer&, const CellTransfer&) = default;
};

// A cell changed hands at the begin of `step`.
struct TerritoryChange {
  std::int64_t step = 0;
  std::uint32_t cell = 0;  // Grid::index_of_cell
  WorldId from{}, to{};
  friend bool operator==(const TerritoryChange&, const TerritoryChange&) = default;
};

enum class MapKind {
  kBlocks,   // recursive bisection of the grid into boxes of nearly equal cell counts
  kKMeans,   // equal-size k-means on the bodies' columns: borders run midway between bodies
  kPaper,    // as in the paper's experiments: paper_map.hpp
  kStatics,  // boxes, cut where statics leave the least room: static_map.hpp
};

struct TerritoryOptions {
  Grid grid;
  std::uint32_t worlds = 1;  // 1 .. grid.cell_count()
  MapKind map = MapKind::kBlocks;
  std::uint64_t seed = 1;  // k-means and paper only
};

// Owner of every cell.
class TerritoryMap {
 public:
  TerritoryMap(Grid grid, std::uint32_t worlds, std::vector<WorldId> owner_of_cell);

  const Grid& grid() const { return grid_; }
  std::uint32_t worlds() const { return worlds_; }
  std::span<const WorldId> owners() const { return owner_of_cell_; }
  WorldId owner_at(const physics::Vec3& point) const;
  // The worlds that own a cell which the box overlaps, ascending; overwrites `out`.
  void owners_of(const physics::Aabb& box, std::vector<WorldId>& out) const;
  // Overwrites `out` with the indices of the cells that `world` owns, the box overlaps, and that
  // lie at the border: next to a cell of another owner, if only with a corner. False if the box
  // also overlaps a cell of the world that does not.
  bool border_cells_of(const physics::Aabb& box, WorldId world,
                       std::vector<std::uint32_t>& out) const;
  // Whether `world` owns all cells that the box overlaps, and none of them lies at the border.
  // False, too, for some boxes of many cells: it looks at one cell only. If true, any box inside
  // `around` is inland, too: need not be asked for; else `around` is left as it is.
  bool is_inland(const physics::Aabb& box, WorldId world, physics::Aabb& around) const;
  // This map after the transfers, in their order.
  TerritoryMap after(std::span<const CellTransfer> transfers) const;

 private:
  Grid grid_;
  std::uint32_t worlds_;
  std::vector<WorldId> owner_of_cell_;
  // By cell: how many cells away the nearest one at the border is, diagonals count as one. 0: it
  // lies at the border itself. Not counted beyond kDeepest.
  std::vector<std::uint8_t> depth_;
};

// `body_positions_m`: initial centres, for k-means and paper, which without any give blocks;
// `scene`: for kStatics, which without one gives blocks. Others ignore them.
TerritoryMap make_territory_map(const TerritoryOptions& options,
                                std::span<const physics::Vec3> body_positions_m,
                                const physics::SceneDescription* scene = nullptr);

}  // namespace soda::models
