#include "models/territory/territory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

std::map<WorldId, std::size_t> cells_per_world(const TerritoryMap& map) {
  std::map<WorldId, std::size_t> cells;
  for (const WorldId owner : map.owners()) ++cells[owner];
  return cells;
}

TEST(Grid, CellsAreHalfOpenAndPointsOutsideBelongToTheNearestCell) {
  const Grid grid{Vec3(-2, 0, 0), 2.0, {3, 2, 1}};
  using Cell = std::array<std::int32_t, 3>;
  EXPECT_EQ(grid.cell_of(Vec3(-2, 0, 0)), (Cell{0, 0, 0}));
  EXPECT_EQ(grid.cell_of(Vec3(-0.001, 1.999, 1)), (Cell{0, 0, 0}));
  EXPECT_EQ(grid.cell_of(Vec3(0, 2, 1)), (Cell{1, 1, 0}));
  EXPECT_EQ(grid.cell_of(Vec3(-1e300, 1e300, 5)), (Cell{0, 1, 0}));
}

TEST(Grid, AbsurdPointsStillHaveACell) {
  const Grid grid{Vec3::Zero(), 1.0, {3, 3, 3}};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  using Cell = std::array<std::int32_t, 3>;
  EXPECT_EQ(grid.cell_of(Vec3(kInfinity, -kInfinity, kNaN)), (Cell{2, 0, 0}));
}

TEST(BlockMap, GivesEveryWorldCellsForAnyNumberOfWorlds) {
  for (const std::array<std::int32_t, 3>& cells :
       {std::array<std::int32_t, 3>{4, 3, 4}, {48, 1, 1}, {3, 2, 8}, {7, 7, 1}}) {
    const Grid grid{Vec3::Zero(), 1.0, cells};
    for (std::uint32_t worlds = 1; worlds <= grid.cell_count(); ++worlds) {
      const TerritoryMap map = make_territory_map({grid, worlds, MapKind::kBlocks, 1}, {});
      ASSERT_EQ(cells_per_world(map).size(), worlds) << cells[0] << cells[1] << cells[2];
    }
  }
}

TEST(BlockMap, EightWorldsOfACubeMeetInItsCentre) {
  const TerritoryMap map =
      make_territory_map({Grid{Vec3(-2, -2, -2), 1.0, {4, 4, 4}}, 8, MapKind::kBlocks, 1}, {});
  std::vector<WorldId> owners;
  map.owners_of({Vec3(-0.1, -0.1, -0.1), Vec3(0.1, 0.1, 0.1)}, owners);
  EXPECT_EQ(owners.size(), 8u);
  for (const auto& [world, cells] : cells_per_world(map)) EXPECT_EQ(cells, 8u);
}

TEST(KMeansMap, BalancesBodiesAndDependsOnTheSeedOnly) {
  test::Choices choices(5);
  std::vector<Vec3> positions;
  for (int i = 0; i < 240; ++i) positions.push_back(choices.vector(0, 30));
  const Grid grid{Vec3::Zero(), 0.5, {60, 60, 2}};
  const TerritoryOptions options{grid, 12, MapKind::kKMeans, 7};
  const TerritoryMap map = make_territory_map(options, positions);
  const TerritoryMap again = make_territory_map(options, positions);
  EXPECT_TRUE(std::ranges::equal(map.owners(), again.owners()));

  // Columns are far narrower than the distance of bodies, so nearly every body is owned by the
  // cluster it was counted in: 20 of 240 each.
  std::map<WorldId, int> bodies;
  for (const Vec3& position : positions) ++bodies[map.owner_at(position)];
  EXPECT_EQ(bodies.size(), 12u);
  for (const auto& [world, count] : bodies) EXPECT_NEAR(count, 20, 3);
}

TEST(KMeansMap, FallsBackToBlocksWithoutBodies) {
  const Grid grid{Vec3::Zero(), 1.0, {4, 4, 1}};
  const TerritoryMap map = make_territory_map({grid, 4, MapKind::kKMeans, 1}, {});
  EXPECT_EQ(cells_per_world(map).size(), 4u);
}

TEST(TerritoryMap, OwnersOfABoxAreThoseOfAllItsPoints) {
  test::Choices choices(9);
  const Grid grid{Vec3::Zero(), 1.0, {5, 4, 6}};
  std::vector<WorldId> owners;
  for (std::size_t i = 0; i < grid.cell_count(); ++i)
    owners.push_back(WorldId{static_cast<std::uint32_t>(choices.below(9))});
  const TerritoryMap map(grid, 9, owners);
  std::vector<WorldId> found;
  for (int repeat = 0; repeat < 500; ++repeat) {
    const Vec3 a = choices.vector(-1, 7), b = choices.vector(-1, 7);
    const physics::Aabb box{a.cwiseMin(b), a.cwiseMax(b)};
    std::set<WorldId> expected;
    for (double x = box.min.x();; x = std::min(x + 0.5, box.max.x())) {
      for (double y = box.min.y();; y = std::min(y + 0.5, box.max.y())) {
        for (double z = box.min.z();; z = std::min(z + 0.5, box.max.z())) {
          expected.insert(map.owner_at(Vec3(x, y, z)));
          if (z == box.max.z()) break;
        }
        if (y == box.max.y()) break;
      }
      if (x == box.max.x()) break;
    }
    map.owners_of(box, found);
    EXPECT_EQ(std::set<WorldId>(found.begin(), found.end()), expected);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    EXPECT_EQ(found.size(), expected.size());
  }
}

// What is said of a box by one look agrees with what is said by looking at all its cells, and most
// small boxes need no more than that look.
TEST(TerritoryMap, InlandBoxesCoverNoBorderCellAndNobodyElses) {
  test::Choices choices(11);
  std::vector<WorldId> owners;
  std::vector<std::uint32_t> cells;
  std::size_t inland = 0, only_inner_cells = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Grid grid{Vec3::Zero(), 1.0, {24, 20, 12}};
    std::vector<Vec3> positions;
    for (int i = 0; i < 12; ++i) positions.push_back(choices.vector(0, 20));
    const MapKind kind = trial % 2 == 0 ? MapKind::kBlocks : MapKind::kKMeans;
    const TerritoryMap map = make_territory_map({grid, 4, kind, 1}, positions);
    for (int i = 0; i < 50; ++i) {
      const Vec3 low = choices.vector(-3, 25);
      const physics::Aabb box{low, low + choices.vector(0, i % 10 == 0 ? 9 : 2)};
      const WorldId world{static_cast<std::uint32_t>(choices.below(4))};
      map.owners_of(box, owners);
      const bool own = map.border_cells_of(box, world, cells) || cells.empty();
      const bool inner = own && cells.empty() && owners == std::vector{world};
      only_inner_cells += inner;
      physics::Aabb around = nowhere();
      if (!map.is_inland(box, world, around)) continue;
      ++inland;
      EXPECT_TRUE(inner) << trial << " " << i;
      map.owners_of(around, owners);
      EXPECT_EQ(owners, std::vector{world});
      EXPECT_FALSE(map.border_cells_of(around, world, cells));
      EXPECT_TRUE(cells.empty());
    }
  }
  EXPECT_GT(inland, only_inner_cells * 3 / 4);
  EXPECT_GT(only_inner_cells, 1000u);
}

}  // namespace
}  // namespace soda::models
