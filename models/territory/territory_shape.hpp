// The shape of territories: which cells share faces, pieces, borders, and changes that keep them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "models/territory/territory.hpp"

namespace soda::models {

// The cells that share a face with `cell`, ascending; up to six.
struct FaceNeighbours {
  std::array<std::uint32_t, 6> cells;
  std::uint32_t count = 0;

  auto begin() const { return cells.begin(); }
  auto end() const { return cells.begin() + count; }
};
FaceNeighbours face_neighbours(const Grid& grid, std::uint32_t cell);

// A map in change, with the cells of each world at hand.
class Territories {
 public:
  explicit Territories(const TerritoryMap& map);

  const Grid& grid() const { return grid_; }
  std::uint32_t worlds() const { return static_cast<std::uint32_t>(cells_.size()); }
  WorldId owner(std::uint32_t cell) const { return owners_[cell]; }
  std::span<const std::uint32_t> cells_of(WorldId world) const { return cells_[index_of(world)]; }
  void give(std::uint32_t cell, WorldId to);

  // Parts of the territory that no face connects; 0 if it has no cell.
  std::size_t pieces(WorldId world) const;
  // Worlds whose cells share a face with one of `world`'s; ascending.
  std::vector<WorldId> neighbours(WorldId world) const;
  // Gives the cells (all of `from`) to `to` if `from` keeps a cell and neither territory has more
  // pieces than before; else changes nothing and returns false.
  bool give_in_one_piece(std::span<const std::uint32_t> cells, WorldId from, WorldId to);

 private:
  Grid grid_;
  std::vector<WorldId> owners_;
  std::vector<std::vector<std::uint32_t>> cells_;  // of each world; in no order that matters
  std::vector<std::uint32_t> place_;               // of each cell in cells_ of its owner
};

}  // namespace soda::models
