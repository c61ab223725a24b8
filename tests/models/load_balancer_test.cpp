// The policy alone: who gives which cells to whom, for loads that are made up.
#include "models/load_balancing/load_balancer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "models/cost/work_cost.hpp"
#include "models/territory/territory_shape.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

// A row of cells in equal shares of neighbouring worlds.
struct Row {
  Grid grid;
  TerritoryMap map;
  LoadPicture picture;
  std::vector<std::uint32_t> processors;

  Row(std::uint32_t worlds, std::uint32_t cells_each)
      : grid{Vec3::Zero(), 1.0, {static_cast<std::int32_t>(worlds * cells_each), 1, 1}},
        map(make_territory_map({grid, worlds, MapKind::kBlocks, 1}, {})) {
    for (std::uint32_t cell = 0; cell < worlds * cells_each; ++cell)
      EXPECT_EQ(map.owners()[cell], WorldId{cell / cells_each});
    for (std::uint32_t world = 0; world < worlds; ++world) processors.push_back(world);
    picture.cell_ns.assign(grid.cell_count(), 0);
    picture.entries.assign(worlds, 0);
  }

  std::vector<CellTransfer> transfers(std::size_t most = 64) const {
    return paper_transfers(picture, map, processors, {.most_cells = most, .delay = 10});
  }
  std::vector<std::int64_t> loads_after(const std::vector<CellTransfer>& transfers) const {
    const TerritoryMap after = map.after(transfers);
    std::vector<std::int64_t> loads(map.worlds(), 0);
    for (std::size_t cell = 0; cell < picture.cell_ns.size(); ++cell)
      loads[index_of(after.owners()[cell])] += picture.cell_ns[cell];
    return loads;
  }
};

TEST(PaperScheme, ALoadedWorldGivesCellsToItsIdleNeighbour) {
  Row row(2, 8);
  for (std::uint32_t cell = 0; cell < 8; ++cell) row.picture.cell_ns[cell] = 1000;
  const std::vector<CellTransfer> transfers = row.transfers();
  ASSERT_FALSE(transfers.empty());
  for (const CellTransfer& transfer : transfers) EXPECT_EQ(transfer.to, WorldId{1});
  const std::vector<std::int64_t> loads = row.loads_after(transfers);
  EXPECT_NEAR(static_cast<double>(loads[0]), 4000.0, 1000.0);
}

TEST(PaperScheme, LoadReachesAHotSpotBehindEmptyCells) {
  Row row(2, 8);
  row.picture.cell_ns[1] = row.picture.cell_ns[3] = 4000;  // the other cells are empty
  const std::vector<std::int64_t> loads = row.loads_after(row.transfers());
  EXPECT_EQ(loads[0], 4000);
  EXPECT_EQ(loads[1], 4000);
}

TEST(PaperScheme, BalancedWorldsAndSmallDifferencesAreLeftAlone) {
  Row row(4, 4);
  for (std::int64_t& load : row.picture.cell_ns) load = 1000;
  EXPECT_TRUE(row.transfers().empty());
  row.picture.cell_ns[5] = 1250;  // 6 % more than the neighbours
  EXPECT_TRUE(row.transfers().empty());
}

TEST(PaperScheme, TheLeastLoadedNeighbourGetsMost) {
  Row row(3, 8);
  for (std::uint32_t cell = 0; cell < 8; ++cell) row.picture.cell_ns[cell] = 500;
  for (std::uint32_t cell = 8; cell < 16; ++cell) row.picture.cell_ns[cell] = 2000;
  std::size_t to_first = 0, to_last = 0;
  for (const CellTransfer& transfer : row.transfers())
    ++(transfer.to == WorldId{0} ? to_first : to_last);
  EXPECT_GT(to_last, to_first);
  EXPECT_GT(to_last, 0u);
}

// An island over the border is solved by both sides: it had better belong to one.
TEST(PaperScheme, AnIslandOfTwoWorldsIsPutTogetherThoughTheLoadsAreEqual) {
  Row row(2, 8);
  for (std::uint32_t cell = 6; cell < 10; ++cell) row.picture.cell_ns[cell] = 1000;
  row.picture.islands.push_back({20'000, 0, {6, 7, 8, 9}, false});
  const TerritoryMap after = row.map.after(row.transfers());
  for (std::uint32_t cell = 7; cell < 10; ++cell)
    EXPECT_EQ(after.owners()[cell], after.owners()[6]) << cell;
}

// Each side does half of it, wherever its bodies lie.
TEST(PaperScheme, AnIslandWhoseSolveIsSharedOutStaysWhereItIs) {
  Row row(2, 8);
  for (std::uint32_t cell = 6; cell < 10; ++cell) row.picture.cell_ns[cell] = 1000;
  row.picture.islands.push_back({20'000, 0, {6, 7, 8, 9}, true});
  EXPECT_TRUE(row.transfers().empty());
}

// Two could do half of the solve each, but then all of the island has to be told.
TEST(PaperScheme, AnIslandIsSharedOutWhereTellingCostsLessThanItsSolve) {
  for (const std::int64_t telling_ns : {100, 100'000}) {
    Row row(2, 8);
    for (std::uint32_t cell = 2; cell < 8; ++cell) row.picture.cell_ns[cell] = 1000;
    row.picture.islands.push_back({20'000, telling_ns, {6, 7}, true});
    const TerritoryMap after = row.map.after(row.transfers());
    const bool is_whole = after.owners()[6] == after.owners()[7];
    EXPECT_EQ(is_whole, telling_ns > 20'000) << telling_ns;
  }
}

TEST(PaperScheme, AnIslandOfOneWorldIsNotCutForTheSakeOfBalance) {
  Row row(2, 8);
  for (std::uint32_t cell = 0; cell < 8; ++cell) row.picture.cell_ns[cell] = 100;
  row.picture.islands.push_back({20'000, 0, {4, 5, 6, 7}, false});
  const TerritoryMap after = row.map.after(row.transfers());
  for (std::uint32_t cell = 5; cell < 8; ++cell)
    EXPECT_EQ(after.owners()[cell], after.owners()[4]) << cell;
}

TEST(PaperScheme, NothingMovesWithinAProcessor) {
  Row row(2, 8);
  for (std::uint32_t cell = 0; cell < 8; ++cell) row.picture.cell_ns[cell] = 1000;
  row.processors = {0, 0};
  EXPECT_TRUE(row.transfers().empty());
}

TEST(PaperScheme, NoMoreCellsAtOnceThanAllowed) {
  Row row(2, 32);
  for (std::uint32_t cell = 0; cell < 32; ++cell) row.picture.cell_ns[cell] = 1000;
  EXPECT_EQ(row.transfers(3).size(), 3u);
}

// 20 % more than the neighbours: too much for who has nothing in store, not for who can wait.
TEST(PaperScheme, AFullBufferMakesAWorldWait) {
  Row row(2, 10);
  for (std::uint32_t cell = 0; cell < 20; ++cell)
    row.picture.cell_ns[cell] = cell < 10 ? 1500 : 1000;
  EXPECT_FALSE(row.transfers().empty());
  row.picture.entries = {1000, 1000};
  EXPECT_TRUE(row.transfers().empty());
}

TEST(PaperScheme, TerritoriesStayInOnePieceHoweverTheLoadsChange) {
  const Grid grid{Vec3::Zero(), 1.0, {8, 8, 3}};
  kernel::SplitMix64 random(7);
  TerritoryMap map = make_territory_map({grid, 9, MapKind::kBlocks, 1}, {});
  std::vector<std::uint32_t> processors{0, 1, 2, 3, 4, 5, 6, 7, 8};
  std::size_t moved = 0;
  for (int round = 0; round < 40; ++round) {
    LoadPicture picture;
    picture.entries.assign(9, 0);
    for (std::size_t cell = 0; cell < grid.cell_count(); ++cell)
      picture.cell_ns.push_back(random.below(4) == 0 ? static_cast<int>(random.below(5000)) : 0);
    for (int island = 0; island < 3; ++island) {
      const auto first = static_cast<std::uint32_t>(random.below(grid.cell_count() - 4));
      picture.islands.push_back(
          {static_cast<std::int64_t>(random.below(9000)), 0, {first, first + 1, first + 3}});
    }
    const std::vector<CellTransfer> transfers = paper_transfers(picture, map, processors, {});
    for (const CellTransfer& transfer : transfers) {
      const FaceNeighbours around = face_neighbours(grid, transfer.cell);
      EXPECT_NE(map.owners()[transfer.cell], transfer.to);
      EXPECT_GT(around.count, 0u);
    }
    moved += transfers.size();
    map = map.after(transfers);
    const Territories territories(map);
    for (std::uint32_t world = 0; world < 9; ++world)
      ASSERT_EQ(territories.pieces(WorldId{world}), 1u) << "round " << round;
  }
  EXPECT_GT(moved, 100u);
}

TEST(RandomTransfers, ChangeManyCellsAndKeepTerritoriesInOnePiece) {
  const Grid grid{Vec3::Zero(), 1.0, {6, 5, 4}};
  kernel::SplitMix64 random(3);
  TerritoryMap map = make_territory_map({grid, 7, MapKind::kBlocks, 1}, {});
  std::size_t moved = 0;
  for (int round = 0; round < 100; ++round) {
    const std::vector<CellTransfer> transfers = random_transfers(map, 3, random);
    moved += transfers.size();
    map = map.after(transfers);
    const Territories territories(map);
    for (std::uint32_t world = 0; world < 7; ++world)
      ASSERT_EQ(territories.pieces(WorldId{world}), 1u) << "round " << round;
  }
  EXPECT_GT(moved, 200u);
}

TEST(LoadPicture, JoinsIslandsOverWorldsAndCountsBodiesWhereTheyWillBe) {
  LoadSample left{.world = WorldId{0}, .step = 10, .bodies = {}, .links = {}, .islands = {}};
  LoadSample right = left;
  right.world = WorldId{1};
  left.bodies = {{BodyId{1}, 0, 1, 100}, {BodyId{2}, 1, 1, 200}};
  right.bodies = {{BodyId{3}, 2, 3, 400}, {BodyId{4}, 3, 3, 800}};
  left.links = {{BodyId{2}, BodyId{3}}};
  left.islands = {{BodyId{2}, 5000}};
  left.entries = 7;
  const LoadPicture picture = picture_of(std::vector{left, right}, 4);
  EXPECT_EQ(picture.cell_ns, (std::vector<std::int64_t>{50, 250, 200, 1000}));
  ASSERT_EQ(picture.islands.size(), 1u);
  EXPECT_EQ(picture.islands[0].solve_ns, 5000);
  EXPECT_EQ(picture.islands[0].telling_ns, 3 * record_cost_ns());  // two bodies and a contact
  EXPECT_EQ(picture.islands[0].cells, (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(picture.entries, (std::vector<std::int64_t>{7, 0}));
}

TEST(LoadSample, IsTheSameAfterItHasTravelled) {
  LoadSample sample;
  sample.world = WorldId{3};
  sample.step = 20;
  sample.spent_ns = 77;
  sample.entries = 5;
  sample.bodies = {{BodyId{1}, 8, 9, 100}, {BodyId{6}, 2, 2, -1}};
  sample.links = {{BodyId{1}, BodyId{6}}};
  sample.islands = {{BodyId{1}, 1234}};
  const LoadSample again = decode_load(encode_load(sample));
  EXPECT_EQ(encode_load(again), encode_load(sample));
  EXPECT_EQ(again.bodies[1].cost_ns, -1);
  EXPECT_EQ(again.islands[0].solve_ns, 1234);
  EXPECT_EQ(again.entries, 5);
}

// The values of the paper's Figure 8 for a ring of 48 entries.
TEST(AnticipationSteps, FollowTheClosedForm) {
  EXPECT_DOUBLE_EQ(anticipation_steps(48, 1.5), 144.0);
  EXPECT_DOUBLE_EQ(anticipation_steps(48, 2.0), 96.0);
  EXPECT_EQ(anticipation_steps(48, 1.0), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace soda::models
