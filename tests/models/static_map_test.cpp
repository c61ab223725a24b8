#include "models/territory/static_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "models/territory/territory_shape.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

void wall(test::Scene& scene, const Vec3& half_extents_m, const Vec3& position_m) {
  physics::StaticBody fixed;
  fixed.shape = scene.shape(physics::Box{half_extents_m});
  fixed.position_m = position_m;
  scene.description.statics.push_back(fixed);
}

// Two rooms of 4 and 6 cells with a thin wall between them: the middle would cut the larger one.
TEST(StaticMap, CutsAlongAWallThoughItIsNotInTheMiddle) {
  test::Scene scene;
  wall(scene, Vec3(0.1, 5, 5), Vec3(4, 0.5, 0.5));
  const Grid grid{Vec3::Zero(), 1.0, {10, 1, 1}};
  const TerritoryMap map = make_static_map(grid, 2, scene.description);
  for (std::uint32_t cell = 0; cell < 10; ++cell)
    EXPECT_EQ(map.owners()[cell], WorldId{cell < 4 ? 0u : 1u}) << cell;
}

// Six cells of solid rock on one side: the room is divided, not the cells.
TEST(StaticMap, SolidCellsDoNotCount) {
  test::Scene scene;
  wall(scene, Vec3(3, 5, 5), Vec3(3, 0.5, 0.5));
  const Grid grid{Vec3::Zero(), 1.0, {12, 1, 1}};
  const TerritoryMap map = make_static_map(grid, 2, scene.description);
  EXPECT_EQ(map.owners()[8], WorldId{0});
  EXPECT_EQ(map.owners()[9], WorldId{1});
}

TEST(StaticMap, WithoutWallsItBalancesAndForAnyNumberOfWorldsEachHasOnePiece) {
  test::Scene scene;
  wall(scene, Vec3(0.2, 1.2, 5), Vec3(2.5, 1.0, 0.5));
  for (const std::array<std::int32_t, 3>& cells :
       {std::array<std::int32_t, 3>{3, 3, 1}, {4, 3, 2}, {7, 1, 1}}) {
    const Grid grid{Vec3::Zero(), 1.0, cells};
    for (std::uint32_t worlds = 1; worlds <= grid.cell_count(); ++worlds) {
      const Territories map(make_static_map(grid, worlds, scene.description));
      for (std::uint32_t world = 0; world < worlds; ++world)
        ASSERT_EQ(map.pieces(WorldId{world}), 1u) << worlds << " worlds, " << world;
    }
  }
  const Grid grid{Vec3::Zero(), 1.0, {8, 8, 1}};
  const Territories map(make_static_map(grid, 4, test::Scene().description));
  for (std::uint32_t world = 0; world < 4; ++world)
    EXPECT_EQ(map.cells_of(WorldId{world}).size(), 16u);
}

}  // namespace
}  // namespace soda::models
