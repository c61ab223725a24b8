// Which cells the boxes of a world's bodies cover. Most bodies are in the cells where they were a
// step before, so the answers are kept, each with the places in which a box must lie for it to hold
// again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "models/territory/territory.hpp"

namespace soda::models {

// What a box covers that is not inland: indices of WorldId that own a covered cell, without the
// world itself, and the covered cells of the world that lie at its border; both ascending.
struct CoveredCells {
  std::span<const std::uint32_t> others, border_cells;
};

// By place of a body. Any other order would do: what a box covers does not depend on whose it is.
// It is no state: the same is answered with and without what is kept.
class CellCovers {
 public:
  // From now on of so many boxes, as `world` sees them under this map.
  void start(const std::shared_ptr<const TerritoryMap>& map, WorldId world, std::size_t boxes);
  // Valid until the next call; `place` < boxes.
  CoveredCells find(std::size_t place, const physics::Aabb& box);
  // Whether a point lies in the cells that were found last for this place, all of which are the
  // world's. False if it cannot tell.
  bool keeps(std::size_t place, const physics::Vec3& point) const;

 private:
  // Half as long as doubles: it is memory that this saves. Rounded to the inside.
  struct Region {
    std::array<float, 3> min, max;
    bool contains(const physics::Vec3& point) const;
  };
  struct Kept {
    Region lower, upper;      // of box.min, of box.max
    std::uint32_t first = 0;  // in lists_: border cells, then others
    std::uint32_t border_cells = 0, others = 0;
  };

  static Region rounded(const physics::Aabb& box);
  Region inside_of(const std::array<std::int32_t, 3>& cell) const;
  void look(const physics::Aabb& box, Kept& kept);

  std::shared_ptr<const TerritoryMap> map_;
  WorldId world_{};
  std::vector<Kept> kept_;
  std::vector<std::uint32_t> lists_;
  std::vector<std::uint32_t> cells_;  // memory only
  std::vector<WorldId> owners_;       // the same
};

}  // namespace soda::models
