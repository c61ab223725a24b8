// Cell covers: what is kept of a box's cells says what the map says.
#include "models/territory/cell_cover.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::Aabb;
using physics::Vec3;

struct Expected {
  std::vector<std::uint32_t> others, border_cells;
};

Expected expected(const TerritoryMap& map, WorldId world, const Aabb& box) {
  Expected out;
  std::vector<WorldId> owners;
  map.owners_of(box, owners);
  for (const WorldId owner : owners)
    if (owner != world) out.others.push_back(index_of(owner));
  map.border_cells_of(box, world, out.border_cells);
  return out;
}

// Boxes that creep, jump, stand across the edge of the grid or cover all of it, in a grid that may
// lie far from the origin. How often an answer was kept is not seen, but that it holds is.
TEST(CellCovers, BoxesThatMoveCoverWhatALookAtTheMapSays) {
  test::Choices choices(5);
  std::size_t with_others = 0, with_border = 0, kept = 0, asked = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const double far = trial % 4 == 0 ? 3e6 : 0.0;
    const Grid grid{Vec3::Constant(far), 1.0, {12, 10, 6}};
    const auto map = std::make_shared<const TerritoryMap>(
        make_territory_map({grid, 5, MapKind::kBlocks, 1}, {}));
    const WorldId world{static_cast<std::uint32_t>(choices.below(5))};
    CellCovers covers;
    Vec3 at = Vec3::Constant(far) + choices.vector(-2, 12);
    for (int step = 0; step < 200; ++step) {
      at += choices.vector(-0.1, 0.1);
      if (step % 40 == 0) at = Vec3::Constant(far) + choices.vector(-2, 12);
      const double size = step % 50 == 7 ? 30.0 : 0.6;
      const Aabb box{at, at + Vec3::Constant(size)};
      covers.start(map, world, 1);
      const CoveredCells found = covers.find(0, box);
      const Expected wanted = expected(*map, world, box);
      ASSERT_TRUE(std::ranges::equal(found.others, wanted.others)) << trial << " " << step;
      ASSERT_TRUE(std::ranges::equal(found.border_cells, wanted.border_cells));
      with_others += !wanted.others.empty();
      with_border += !wanted.border_cells.empty();
      const Vec3 point = at + choices.vector(-0.5, 1.1);
      ++asked;
      if (!covers.keeps(0, point)) continue;
      ++kept;
      ASSERT_EQ(map->owner_at(point), world) << trial << " " << step;
    }
  }
  EXPECT_GT(with_others, asked / 10);
  EXPECT_GT(with_border, asked / 20);
  EXPECT_GT(kept, asked / 50);
}

TEST(CellCovers, AnotherMapIsAskedAnew) {
  const Grid grid{Vec3::Zero(), 1.0, {4, 1, 1}};
  const auto before = std::make_shared<const TerritoryMap>(
      grid, 2, std::vector{WorldId{0}, WorldId{0}, WorldId{1}, WorldId{1}});
  const auto after = std::make_shared<const TerritoryMap>(
      grid, 2, std::vector{WorldId{0}, WorldId{1}, WorldId{1}, WorldId{1}});
  const Aabb box{Vec3(1.2, 0.2, 0.2), Vec3(1.8, 0.8, 0.8)};
  CellCovers covers;
  covers.start(before, WorldId{0}, 1);
  EXPECT_TRUE(covers.find(0, box).others.empty());
  EXPECT_TRUE(covers.keeps(0, Vec3(1.5, 0.5, 0.5)));
  covers.start(after, WorldId{0}, 1);
  EXPECT_FALSE(covers.keeps(0, Vec3(1.5, 0.5, 0.5))) << "nothing is known of this map yet";
  EXPECT_EQ(covers.find(0, box).others.size(), 1u);
  EXPECT_FALSE(covers.keeps(0, Vec3(1.5, 0.5, 0.5)));
}

}  // namespace
}  // namespace soda::models
