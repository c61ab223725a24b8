#include "models/territory/paper_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "models/territory/territory_shape.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

const Grid kGrid{Vec3(-10, -10, 0), 0.5, {40, 40, 3}};

std::vector<Vec3> bodies(int count) {
  test::Choices choices(11);
  std::vector<Vec3> positions;
  for (int i = 0; i < count; ++i) positions.push_back(choices.vector(-10, 10));
  return positions;
}

std::vector<std::size_t> cells_of_worlds(const TerritoryMap& map) {
  std::vector<std::size_t> cells(map.worlds(), 0);
  for (const WorldId owner : map.owners()) ++cells[index_of(owner)];
  return cells;
}

TEST(PaperMap, SharesColumnsOutEquallyForAnyNumberOfBodiesAndWorlds) {
  for (const int count : {1, 5, 60, 500}) {
    for (const std::uint32_t worlds : {1u, 2u, 7u, 12u, 100u, 1600u}) {
      const TerritoryMap map = make_paper_map(kGrid, worlds, 3, bodies(count));
      const auto [least, most] = std::ranges::minmax(cells_of_worlds(map));
      EXPECT_LE(most - least, 3u) << count << " " << worlds;  // one column
      EXPECT_GE(least, 3u) << count << " " << worlds;
      for (std::size_t cell = 0; cell < map.owners().size(); cell += 3)
        ASSERT_TRUE(map.owners()[cell] == map.owners()[cell + 1] &&
                    map.owners()[cell] == map.owners()[cell + 2]);
    }
  }
}

TEST(PaperMap, IsMadeOfBlocksWhereThereAreMoreWorldsThanColumns) {
  const TerritoryMap map = make_paper_map(kGrid, 1601, 3, bodies(20));
  EXPECT_GE(std::ranges::min(cells_of_worlds(map)), 1u);
}

TEST(PaperMap, DependsOnBodiesAndSeedOnly) {
  const auto owners = [](int count, std::uint64_t seed) {
    const TerritoryMap map = make_territory_map({kGrid, 12, MapKind::kPaper, seed}, bodies(count));
    return std::vector(map.owners().begin(), map.owners().end());
  };
  EXPECT_EQ(owners(100, 1), owners(100, 1));
  EXPECT_NE(owners(100, 1), owners(100, 2));
  EXPECT_NE(owners(100, 1), owners(101, 1));
}

// Columns belong to the nearest centre as long as it has room: clusters that keep apart keep their
// bodies.
TEST(PaperMap, GivesClustersThatKeepApartAWorldEach) {
  std::vector<Vec3> positions;
  for (int i = 0; i < 40; ++i)
    positions.emplace_back((i % 4 < 2 ? -5 : 5) + 0.05 * i, (i % 2 < 1 ? -5 : 5) + 0.02 * i, 1);
  // From unlucky centres k-means ends elsewhere.
  bool found = false;
  for (std::uint64_t seed = 1; seed <= 20 && !found; ++seed) {
    const TerritoryMap map = make_paper_map(kGrid, 4, seed, positions);
    std::array<std::set<WorldId>, 4> owners;
    for (std::size_t i = 0; i < positions.size(); ++i)
      owners[i % 4].insert(map.owner_at(positions[i]));
    found = std::ranges::all_of(owners, [](const auto& s) { return s.size() == 1; });
  }
  EXPECT_TRUE(found);
}

// What is left over for the last columns makes borders longer than compact blocks have, and
// territories of several pieces.
TEST(PaperMap, HasRaggedBorders) {
  constexpr std::uint32_t kWorlds = 12;
  constexpr std::uint64_t kSeeds = 20;
  const Grid grid{Vec3(-10, -10, 0), 0.2, {100, 100, 1}};
  const auto border_cells = [](const TerritoryMap& map) {
    std::size_t cells = 0;
    for (std::uint32_t cell = 0; cell < map.owners().size(); ++cell)
      cells += std::ranges::any_of(face_neighbours(map.grid(), cell), [&](std::uint32_t other) {
        return map.owners()[other] != map.owners()[cell];
      });
    return cells;
  };
  std::size_t cells = 0, pieces = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const TerritoryMap map = make_paper_map(grid, kWorlds, seed, bodies(200));
    cells += border_cells(map);
    const Territories territories(map);
    for (std::uint32_t world = 0; world < kWorlds; ++world)
      pieces += territories.pieces(WorldId{world});
  }
  EXPECT_GT(cells, kSeeds * border_cells(make_territory_map({grid, kWorlds}, {})) * 11 / 10);
  EXPECT_GT(pieces, kSeeds * kWorlds);
}

TEST(PaperMap, LeavesTheTrajectoryAsItIs) {
  const test::Scene scene = busy_scene(4);
  std::vector<Vec3> positions;
  for (const physics::BodyState& state : scene.states) positions.push_back(state.position_m);
  const RunOptions alone{.steps = 40};
  const std::vector<std::uint64_t> expected = run(scene, blocks(1), alone).digests;
  for (const std::uint32_t worlds : {3u, 12u, 40u}) {
    const Grid grid{Vec3(-4, -4, 0), 1.0, {8, 8, 4}};
    const TerritoryMap map =
        make_territory_map({grid, worlds, MapKind::kPaper, 9}, positions, &scene.description);
    const RunOutcome outcome =
        run(scene, map, {.executor = ExecutorKind::kThreads, .threads = 2, .steps = 40});
    EXPECT_EQ(outcome.digests, expected) << worlds;
    EXPECT_GT(outcome.result.worlds.ghosts_sent, 0u);
  }
}

}  // namespace
}  // namespace soda::models
