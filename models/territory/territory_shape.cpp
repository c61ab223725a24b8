#include "models/territory/territory_shape.hpp"

#include <algorithm>

namespace soda::models {

FaceNeighbours face_neighbours(const Grid& grid, std::uint32_t cell) {
  const auto nz = static_cast<std::uint32_t>(grid.cells[2]);
  const auto ny = static_cast<std::uint32_t>(grid.cells[1]);
  const auto nx = static_cast<std::uint32_t>(grid.cells[0]);
  const std::uint32_t z = cell % nz, y = cell / nz % ny, x = cell / nz / ny;
  FaceNeighbours out;
  const auto add = [&](bool exists, std::uint32_t neighbour) {
    if (exists) out.cells[out.count++] = neighbour;
  };
  add(x > 0, cell - ny * nz);
  add(y > 0, cell - nz);
  add(z > 0, cell - 1);
  add(z + 1 < nz, cell + 1);
  add(y + 1 < ny, cell + nz);
  add(x + 1 < nx, cell + ny * nz);
  return out;
}

Territories::Territories(const TerritoryMap& map)
    : grid_(map.grid()),
      owners_(map.owners().begin(), map.owners().end()),
      cells_(map.worlds()),
      place_(owners_.size()) {
  for (std::uint32_t cell = 0; cell < owners_.size(); ++cell) {
    std::vector<std::uint32_t>& cells = cells_[index_of(owners_[cell])];
    place_[cell] = static_cast<std::uint32_t>(cells.size());
    cells.push_back(cell);
  }
}

void Territories::give(std::uint32_t cell, WorldId to) {
  std::vector<std::uint32_t>& from = cells_[index_of(owners_[cell])];
  from[place_[cell]] = from.back();
  place_[from.back()] = place_[cell];
  from.pop_back();
  owners_[cell] = to;
  place_[cell] = static_cast<std::uint32_t>(cells_[index_of(to)].size());
  cells_[index_of(to)].push_back(cell);
}

std::size_t Territories::pieces(WorldId world) const {
  const std::vector<std::uint32_t>& cells = cells_[index_of(world)];
  std::vector<char> seen(cells.size(), false);
  std::vector<std::uint32_t> open;
  std::size_t pieces = 0;
  for (const std::uint32_t start : cells) {
    if (seen[place_[start]]) continue;
    ++pieces;
    seen[place_[start]] = true;
    open.push_back(start);
    while (!open.empty()) {
      const std::uint32_t cell = open.back();
      open.pop_back();
      for (const std::uint32_t next : face_neighbours(grid_, cell)) {
        if (owners_[next] != world || seen[place_[next]]) continue;
        seen[place_[next]] = true;
        open.push_back(next);
      }
    }
  }
  return pieces;
}

std::vector<WorldId> Territories::neighbours(WorldId world) const {
  std::vector<WorldId> out;
  for (const std::uint32_t cell : cells_[index_of(world)])
    for (const std::uint32_t next : face_neighbours(grid_, cell))
      if (owners_[next] != world) out.push_back(owners_[next]);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

bool Territories::give_in_one_piece(std::span<const std::uint32_t> cells, WorldId from,
                                    WorldId to) {
  if (cells.size() >= cells_of(from).size()) return false;
  const std::size_t before_from = pieces(from), before_to = pieces(to);
  for (const std::uint32_t cell : cells) give(cell, to);
  if (pieces(from) <= before_from && pieces(to) <= std::max<std::size_t>(before_to, 1)) return true;
  for (const std::uint32_t cell : cells) give(cell, from);
  return false;
}

}  // namespace soda::models
