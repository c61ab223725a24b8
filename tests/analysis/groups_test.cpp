#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "analysis/groups/groups_report.hpp"
#include "analysis/groups/groups_sweep.hpp"
#include "analysis/groups/paper_scene.hpp"
#include "analysis/groups/sync_groups.hpp"
#include "tests/support/scenes.hpp"

namespace soda::analysis {
namespace {

using models::MapKind;
using models::WorldId;
using physics::BodyId;
using physics::Vec3;

SweepResult swept(GroupBond bond, MapKind map, std::int64_t bodies, std::uint32_t worlds,
                  SeedRange seeds = {1, 20}) {
  return sweep_groups({{bond, map, bodies, worlds, nullptr}}, seeds, [](std::size_t) {}).front();
}

TEST(SyncGroups, CountWorldsByTheSizeOfTheirGroup) {
  SyncGroups groups(20);
  for (std::uint32_t i = 1; i < 4; ++i) groups.bond(WorldId{0}, WorldId{i});      // 4
  for (std::uint32_t i = 4; i < 8; ++i) groups.bond(WorldId{i + 1}, WorldId{i});  // 5
  for (std::uint32_t i = 9; i < 17; ++i) groups.bond(WorldId{i}, WorldId{17});    // 9
  groups.bond(WorldId{18}, WorldId{18});
  EXPECT_EQ(groups.sizes(), (std::vector<std::uint32_t>{9, 5, 4, 1, 1}));
  EXPECT_EQ(groups.shares(), (GroupShares{0.1, 0.2, 0.25, 0.45}));
}

// Against what follows from the definition: worlds that a path of bonds connects.
TEST(SyncGroups, AreClosedUnderBondsInAnyOrder) {
  test::Choices choices(7);
  for (int trial = 0; trial < 200; ++trial) {
    const auto worlds = static_cast<std::uint32_t>(1 + choices.below(15));
    std::vector<std::vector<bool>> joined(worlds, std::vector<bool>(worlds));
    SyncGroups groups(worlds);
    for (std::uint32_t i = 0; i < worlds; ++i) joined[i][i] = true;
    for (std::uint64_t bonds = choices.below(12); bonds > 0; --bonds) {
      const auto a = static_cast<std::uint32_t>(choices.below(worlds));
      const auto b = static_cast<std::uint32_t>(choices.below(worlds));
      groups.bond(WorldId{a}, WorldId{b});
      joined[a][b] = joined[b][a] = true;
    }
    for (std::uint32_t via = 0; via < worlds; ++via)
      for (std::uint32_t a = 0; a < worlds; ++a)
        for (std::uint32_t b = 0; b < worlds; ++b)
          if (joined[a][via] && joined[via][b]) joined[a][b] = true;
    double alone = 0.0, squares = 0.0, expected_squares = 0.0;
    for (std::uint32_t a = 0; a < worlds; ++a) {
      const auto size = std::ranges::count(joined[a], true);
      alone += size == 1;
      expected_squares += static_cast<double>(size);
    }
    for (const std::uint32_t size : groups.sizes()) squares += double{1} * size * size;
    EXPECT_DOUBLE_EQ(groups.shares()[0], alone / worlds);
    EXPECT_DOUBLE_EQ(squares, expected_squares);
  }
}

TEST(SyncGroups, ABodyBondsItsWorldWithAllThatItsBoxOverlaps) {
  const models::TerritoryMap map = models::make_territory_map(
      {models::Grid{Vec3::Zero(), 1.0, {4, 1, 1}}, 4, MapKind::kBlocks, 1}, {});
  const auto sizes = [&map](double low, double high) {
    SyncGroups groups(4);
    const physics::Aabb box{Vec3(low, 0.2, 0.2), Vec3(high, 0.8, 0.8)};
    bond_by_overlap(std::vector{box}, std::vector{map.owner_at(box.min)}, map, groups);
    return groups.sizes();
  };
  using Sizes = std::vector<std::uint32_t>;
  EXPECT_EQ(sizes(0.1, 0.9), (Sizes{1, 1, 1, 1}));
  EXPECT_EQ(sizes(0.1, 1.1), (Sizes{2, 1, 1}));
  EXPECT_EQ(sizes(0.9, 2.1), (Sizes{3, 1}));
}

TEST(SyncGroups, ContactsBondTheOwnersOfBodiesAndStaticsNobody) {
  const std::vector<BodyId> ids{BodyId{3}, BodyId{5}, BodyId{8}};
  const std::vector<WorldId> owners{WorldId{0}, WorldId{2}, WorldId{1}};
  physics::ContactManifold touching, resting;
  touching.a = BodyId{5};
  touching.b = BodyId{8};
  resting.a = BodyId{3};
  resting.b = physics::static_id(0);
  SyncGroups groups(3);
  bond_by_contact(std::vector{touching, resting}, ids, owners, groups);
  EXPECT_EQ(groups.sizes(), (std::vector<std::uint32_t>{2, 1}));
}

// The law in the form in which it is known: critical bodies a world are 0.153 / sqrt(fraction).
TEST(Percolation, ThresholdIsThatOfTheCubicLattice) {
  for (const std::uint32_t worlds : {100u, 480u, 2000u}) {
    const double bodies = Percolation(worlds, MapKind::kBlocks).threshold_bodies();
    const double fraction = bodies * kPaperBody_m / (kPaperSide_m * kPaperSide_m * kPaperHeight_m);
    EXPECT_NEAR(bodies / worlds, 0.153 / std::sqrt(fraction), 0.01 * bodies / worlds);
  }
  EXPECT_NEAR(Percolation(480, MapKind::kBlocks).threshold_bodies(), 2348, 5);
  const Percolation columns(100, MapKind::kPaper);
  EXPECT_NEAR(columns.bodies_on_face(columns.threshold_bodies()), 0.693, 0.001);
  EXPECT_NEAR(columns.bond_probability(columns.threshold_bodies()), 0.5, 1e-12);
}

TEST(Percolation, SharesOfWorldsAloneAreThoseOfTheLaw) {
  for (const auto& [bodies, worlds] : {std::pair{100, 12u}, {500, 100u}, {1000, 480u}}) {
    const SweepResult result = swept(GroupBond::kOverlap, MapKind::kBlocks, bodies, worlds);
    EXPECT_NEAR(result.shares[0].mean, Percolation(worlds, MapKind::kBlocks).alone(bodies), 0.1)
        << bodies << " " << worlds;
  }
}

TEST(GroupsSweep, ThresholdOf480WorldsLiesBetween2000And4000Bodies) {
  std::vector<SweepPoint> points;
  for (std::int64_t bodies = 1000; bodies <= 5000; bodies += 1000)
    points.push_back({GroupBond::kOverlap, MapKind::kBlocks, bodies, 480, nullptr});
  const std::vector<SweepResult> series = sweep_groups(points, {1, 5}, [](std::size_t) {});
  EXPECT_GE(measured_threshold(series), 2000);
  EXPECT_LE(measured_threshold(series), 4000);
  EXPECT_LT(series.front().largest.mean, 0.1);
  EXPECT_GT(series.back().largest.mean, 0.9);
}

// Whoever touches overlaps the same cell.
TEST(GroupsSweep, ContactBondsFarFewerWorldsThanOverlap) {
  for (const MapKind map : {MapKind::kPaper, MapKind::kBlocks}) {
    const SweepResult overlap = swept(GroupBond::kOverlap, map, 500, 12);
    const SweepResult contact = swept(GroupBond::kContact, map, 500, 12);
    EXPECT_LT(overlap.shares[0].mean, 0.3);
    EXPECT_GT(contact.shares[0].mean, 0.95);
  }
}

TEST(GroupsSweep, RaggedTerritoriesDependOnEachOtherMore) {
  const SweepResult paper = swept(GroupBond::kOverlap, MapKind::kPaper, 500, 12);
  const SweepResult blocks = swept(GroupBond::kOverlap, MapKind::kBlocks, 500, 12);
  EXPECT_GT(paper.shares[3].mean, blocks.shares[3].mean + 0.15);
}

TEST(GroupsSweep, IntervalsAreStudentsAndASingleSeedHasNone) {
  const SweepResult one = swept(GroupBond::kOverlap, MapKind::kBlocks, 200, 12, {4, 4});
  EXPECT_TRUE(std::isnan(one.shares[0].half_width));
  const SweepResult other = swept(GroupBond::kOverlap, MapKind::kBlocks, 200, 12, {5, 5});
  const SweepResult both = swept(GroupBond::kOverlap, MapKind::kBlocks, 200, 12, {4, 5});
  const double a = one.shares[0].mean, b = other.shares[0].mean;
  EXPECT_DOUBLE_EQ(both.shares[0].mean, 0.5 * (a + b));
  EXPECT_NEAR(both.shares[0].half_width, 12.7062 * 0.5 * std::abs(a - b), 1e-3);
}

TEST(GroupsReport, FindsFaultWithARowThatIsOffByMoreThanFivePoints) {
  FigureRow row{6, MapKind::kBlocks, 500, 12, {}};
  const SweepPoint point{GroupBond::kOverlap, MapKind::kBlocks, 500, 12, &row};
  const auto result = [&point] {
    return sweep_groups({point}, {1, 3}, [](std::size_t) {}).front();
  };
  const SweepResult off = result();
  for (std::size_t k = 0; k < kGroupClasses; ++k)
    row.per_cent[k] = static_cast<int>(std::lround(100.0 * off.shares[k].mean)) + (k == 1 ? 4 : 0);
  EXPECT_FALSE(is_off(result()));
  row.per_cent[1] += 3;
  EXPECT_TRUE(is_off(result()));
  EXPECT_FALSE(is_off(swept(GroupBond::kOverlap, MapKind::kBlocks, 500, 12, {1, 3})));
}

TEST(GroupsReport, SeriesGoOverBodiesOrOverWorlds) {
  const auto lengths = [](const std::vector<SweepPoint>& points) {
    std::vector<SweepResult> results;
    for (const SweepPoint& point : points) results.push_back({point, {}, {}, {}, 0.0, 0.0});
    std::vector<std::size_t> sizes;
    for (const auto& series : series_of(results)) sizes.push_back(series.size());
    return sizes;
  };
  const auto kBy = GroupBond::kOverlap;
  using Sizes = std::vector<std::size_t>;
  EXPECT_EQ(lengths({{kBy, MapKind::kPaper, 50, 12},
                     {kBy, MapKind::kPaper, 60, 12},
                     {kBy, MapKind::kBlocks, 50, 12},
                     {kBy, MapKind::kBlocks, 60, 12}}),
            (Sizes{2, 2}));
  EXPECT_EQ(lengths({{kBy, MapKind::kPaper, 50, 12},
                     {kBy, MapKind::kPaper, 50, 24},
                     {kBy, MapKind::kBlocks, 50, 12}}),
            (Sizes{2, 1}));
}

}  // namespace
}  // namespace soda::analysis
