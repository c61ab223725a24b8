#include "models/territory/territory_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "models/territory/map_share.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

TEST(TerritoryShape, CellsShareFacesWithTheCellsOneStepAlongAnAxis) {
  const Grid grid{Vec3::Zero(), 1.0, {4, 3, 5}};
  for (std::int32_t x = 0; x < 4; ++x)
    for (std::int32_t y = 0; y < 3; ++y)
      for (std::int32_t z = 0; z < 5; ++z) {
        std::vector<std::uint32_t> expected;
        for (const auto& [dx, dy, dz] :
             {std::array{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}) {
          const std::array<std::int32_t, 3> cell{x + dx, y + dy, z + dz};
          bool inside = true;
          for (int axis = 0; axis < 3; ++axis)
            inside = inside && cell[axis] >= 0 && cell[axis] < grid.cells[axis];
          if (inside) expected.push_back(static_cast<std::uint32_t>(grid.index_of_cell(cell)));
        }
        std::sort(expected.begin(), expected.end());
        const FaceNeighbours found =
            face_neighbours(grid, static_cast<std::uint32_t>(grid.index_of_cell({x, y, z})));
        EXPECT_EQ(std::vector<std::uint32_t>(found.begin(), found.end()), expected);
      }
}

// A row of six cells: 0 0 1 1 1 0.
TEST(TerritoryShape, CountsPiecesAndRefusesGiftsThatMakeMoreOfThem) {
  const Grid grid{Vec3::Zero(), 1.0, {6, 1, 1}};
  const auto world = [](std::uint32_t id) { return WorldId{id}; };
  Territories row({grid, 2, {world(0), world(0), world(1), world(1), world(1), world(0)}});
  EXPECT_EQ(row.pieces(world(0)), 2u);
  EXPECT_EQ(row.pieces(world(1)), 1u);
  EXPECT_EQ(row.neighbours(world(0)), std::vector<WorldId>{world(1)});
  const std::vector<std::uint32_t> middle{3}, edge{2}, all{2, 3, 4}, far{0};
  EXPECT_FALSE(row.give_in_one_piece(middle, world(1), world(0))) << "it would be cut in two";
  EXPECT_FALSE(row.give_in_one_piece(all, world(1), world(0))) << "nothing would be left";
  EXPECT_FALSE(row.give_in_one_piece(far, world(0), world(1))) << "it is out of reach";
  EXPECT_EQ(row.owner(3), world(1)) << "a refused gift changes nothing";
  EXPECT_TRUE(row.give_in_one_piece(edge, world(1), world(0)));
  EXPECT_EQ(row.owner(2), world(0));
  EXPECT_EQ(row.cells_of(world(1)).size(), 2u);
}

TEST(TerritoryMap, AfterTransfersItHasTheBordersOfAMapMadeAnew) {
  const Grid grid{Vec3::Zero(), 1.0, {9, 1, 1}};
  std::vector<WorldId> owners(9, WorldId{0});
  owners[8] = WorldId{1};
  const TerritoryMap before(grid, 2, owners);
  owners[7] = owners[6] = WorldId{1};
  const TerritoryMap anew(grid, 2, owners);
  const TerritoryMap after =
      before.after(std::vector<CellTransfer>{{7, WorldId{1}}, {6, WorldId{1}}});
  for (const std::uint32_t world : {0u, 1u})
    for (double x = 0.25; x < 9.0; x += 0.5) {
      const physics::Aabb box{Vec3(x, 0.5, 0.5), Vec3(x + 0.5, 0.5, 0.5)};
      std::vector<std::uint32_t> found, expected;
      EXPECT_EQ(after.border_cells_of(box, WorldId{world}, found),
                anew.border_cells_of(box, WorldId{world}, expected));
      EXPECT_EQ(found, expected) << x;
    }
}

TEST(MapShare, EqualChangesOfOneMapAreOneObjectAndOthersAreNot) {
  const auto start = std::make_shared<const TerritoryMap>(
      Grid{Vec3::Zero(), 1.0, {3, 1, 1}}, 2,
      std::vector<WorldId>{WorldId{0}, WorldId{0}, WorldId{1}});
  const std::vector<CellTransfer> gift{{1, WorldId{1}}}, other{{2, WorldId{0}}};
  MapShare share;
  const auto after = share.after(start, gift);
  EXPECT_EQ(after->owners()[1], WorldId{1});
  EXPECT_EQ(start->owners()[1], WorldId{0}) << "maps do not change";
  EXPECT_EQ(share.after(start, gift), after);
  EXPECT_NE(share.after(start, other), after);
  EXPECT_NE(share.after(after, gift), after) << "it starts from another map";
}

}  // namespace
}  // namespace soda::models
