#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "physics/integrators/advance_once.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/split_solver.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

// Boxes dropped into a trough, `length` of them along it: one island once they lie.
World trough(int length, Material material = {0.5, 0.0}) {
  World world = test::under_gravity();
  world.scene.solver.direct = false;  // else what is quasi-static in it has no blocks
  world.add_floor(material);
  const std::uint32_t wall = world.add_shape(Box{Vec3(100, 0.5, 20)});
  world.add_static(wall, Vec3(0, -2.3, 0));
  world.add_static(wall, Vec3(0, 2.3, 0));
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 9 * length; ++i) {
    const int x = i % length, y = i / length % 3, z = i / length / 3;
    world.add_body(box, Vec3(1.01 * x + 0.3 * (z % 2), 1.1 * (y - 1), 0.5 + 1.02 * z), 1000.0,
                   material);
  }
  return world;
}

// The largest island of the world's next step.
struct Island {
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  std::vector<ContactManifold> manifolds;
};

Island largest_island(World& world) {
  const Geometry geometry(world.scene);
  StepScratch& scratch = world.scratch;
  compute_boxes(world.scene, geometry, world.ids, world.states, scratch.boxes, world.counters);
  find_contacts(world.scene, geometry, world.ids, world.states, scratch, world.counters);
  build_islands(world.ids, scratch.manifolds, scratch.islands);
  Island largest;
  for (std::size_t i = 0; i < scratch.islands.count(); ++i) {
    std::vector<BodyState> states = world.states;
    gather_island(i, world.ids, states, scratch);
    if (scratch.island_ids.size() > largest.ids.size())
      largest = {scratch.island_ids, scratch.island_states, scratch.island_manifolds};
  }
  return largest;
}

Island settled_trough() {
  World world = trough(30);
  world.run(12);
  return largest_island(world);
}

// As one island with one block: the order of rows that small islands have.
IslandBlocks one_block(const Island& island) {
  IslandBlocks blocks;
  blocks.inside.resize(1);
  for (std::uint32_t i = 0; i < island.ids.size(); ++i) {
    blocks.inside[0].bodies.push_back(i);
    blocks.block_of.push_back(0);
    blocks.place_in.push_back(i);
  }
  for (std::uint32_t m = 0; m < island.manifolds.size(); ++m)
    blocks.inside[0].manifolds.push_back(m);
  return blocks;
}

std::uint32_t block_of(const Island& island, const IslandBlocks& blocks, BodyId id) {
  const auto place = std::lower_bound(island.ids.begin(), island.ids.end(), id);
  return blocks.block_of[static_cast<std::size_t>(place - island.ids.begin())];
}

TEST(LargeIslands, BlocksAreAChainAndNoBodyLiesAtTwoBorders) {
  const Island island = settled_trough();
  const IslandBlocks blocks = split_island(island.ids, island.manifolds);
  ASSERT_GE(blocks.count(), 4u);
  ASSERT_EQ(blocks.borders.size(), blocks.count() - 1);
  std::vector<int> seen(island.ids.size(), 0), at_borders(island.ids.size(), 0);
  for (const IslandPart& block : blocks.inside)
    for (const std::uint32_t body : block.bodies) ++seen[body];
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(seen.size()));
  std::size_t contacts = 0;
  for (std::uint32_t c = 0; c < blocks.count(); ++c) {
    for (const std::uint32_t m : blocks.inside[c].manifolds) {
      const ContactManifold& manifold = island.manifolds[m];
      EXPECT_EQ(block_of(island, blocks, manifold.a), c);
      const BodyId other = is_static(manifold.b) ? manifold.a : manifold.b;
      EXPECT_EQ(block_of(island, blocks, other), c);
      ++contacts;
    }
  }
  for (std::uint32_t c = 0; c + 1 < blocks.count(); ++c) {
    for (const std::uint32_t m : blocks.borders[c].manifolds) {
      const std::uint32_t a = block_of(island, blocks, island.manifolds[m].a);
      const std::uint32_t b = block_of(island, blocks, island.manifolds[m].b);
      EXPECT_EQ(std::min(a, b), c);
      EXPECT_EQ(std::max(a, b), c + 1);
      ++contacts;
    }
    for (const std::uint32_t body : blocks.borders[c].bodies) ++at_borders[body];
  }
  EXPECT_EQ(contacts, island.manifolds.size());
  EXPECT_LE(*std::max_element(at_borders.begin(), at_borders.end()), 1);
}

// Two arms of equal length from the lowest id: either could be the far end.
Island two_arms() {
  Island island;
  for (std::uint32_t i = 0; i <= 200; ++i) island.ids.push_back(BodyId{i});
  for (std::uint32_t i = 1; i <= 200; ++i) {
    ContactManifold manifold;
    manifold.a = BodyId{i <= 2 ? 0 : i - 2};
    manifold.b = BodyId{i};
    manifold.count = 4;
    island.manifolds.push_back(manifold);
  }
  return island;
}

TEST(LargeIslands, BlocksDoNotDependOnTheOrderOfContacts) {
  std::mt19937 random(3);
  for (Island island : {settled_trough(), two_arms()}) {
    const IslandBlocks blocks = split_island(island.ids, island.manifolds);
    ASSERT_GT(blocks.count(), 1u);
    for (int i = 0; i < 5; ++i) {
      std::shuffle(island.manifolds.begin(), island.manifolds.end(), random);
      EXPECT_EQ(split_island(island.ids, island.manifolds).block_of, blocks.block_of);
    }
  }
}

TEST(LargeIslands, WhatAllBodiesTouchCannotBeCut) {
  Island island;
  for (std::uint32_t i = 0; i < 400; ++i) island.ids.push_back(BodyId{i});
  for (std::uint32_t i = 1; i < 400; ++i) {
    ContactManifold manifold;
    manifold.a = BodyId{0};
    manifold.b = BodyId{i};
    manifold.count = 4;
    island.manifolds.push_back(manifold);
  }
  EXPECT_EQ(split_island(island.ids, island.manifolds).count(), 1u);
}

// Solvers of neighbouring ranges, each with its own memory, tell each other of their borders.
void solve_together(const Island& island, const IslandBlocks& blocks, const SceneDescription& scene,
                    const std::vector<std::uint32_t>& ends, std::vector<BodyState>& states,
                    IslandReport& report) {
  const LargeIsland large{scene, scene.dt_s, island.ids, island.manifolds, island.states, blocks};
  StageCounters counters;
  std::vector<BlockSolver> solvers;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i)
    solvers.emplace_back(large, ends[i], ends[i + 1], counters);
  const std::uint32_t stages = BlockSolver::stages(
      {scene, scene.dt_s, island.ids, std::span<const BodyState>(island.states)});
  for (std::uint32_t stage = 0; stage < stages; ++stage) {
    for (BlockSolver& solver : solvers) solver.solve_blocks(stage, counters);
    std::vector<std::vector<BorderBody>> lower, upper;
    for (const BlockSolver& solver : solvers) {
      lower.push_back(solver.at_lower());
      upper.push_back(solver.at_upper());
    }
    for (std::size_t i = solvers.size(); i-- > 0;) {
      const bool takes_lower = i == 0 || solvers[i].take_lower(upper[i - 1]);
      const bool takes_upper = i + 1 == solvers.size() || solvers[i].take_upper(lower[i + 1]);
      ASSERT_TRUE(takes_lower && takes_upper);
      solvers[i].solve_borders(stage, counters);
    }
  }
  std::vector<AdvanceFault> faults;
  for (std::size_t i = 0; i < solvers.size(); ++i) {
    for (std::uint32_t block = ends[i]; block < ends[i + 1]; ++block) {
      add(solvers[i].report(block), report);
      std::vector<BodyState> moved;
      solvers[i].move(block, moved, faults);
      for (std::size_t body = 0; body < moved.size(); ++body)
        states[blocks.inside[block].bodies[body]] = moved[body];
    }
  }
  EXPECT_TRUE(faults.empty());
}

TEST(LargeIslands, AnyDivisionOfTheBlocksAmongSolversHasTheBitsOfOneSolver) {
  World world = trough(30);
  world.run(12);  // still falling in: there is overlap to push out
  const Island island = largest_island(world);
  const IslandBlocks blocks = split_island(island.ids, island.manifolds);
  const auto count = static_cast<std::uint32_t>(blocks.count());
  ASSERT_GE(count, 4u);
  std::vector<BodyState> alone = island.states;
  std::vector<AdvanceFault> faults;
  SolveScratch scratch;
  const Geometry geometry(world.scene);
  const IslandReport whole =
      advance_once(whole_step(world.scene, geometry, island.ids, island.manifolds),
                   Exactness::kOngoing, alone, {scratch, world.counters, faults});
  std::mt19937 random(7);
  for (int trial = 0; trial < 6; ++trial) {
    std::vector<std::uint32_t> ends{0, count};
    for (std::uint32_t end = 1; end < count; ++end)
      if (trial == 0 || random() % 2 == 0) ends.insert(ends.end() - 1, end);
    std::vector<BodyState> together = island.states;
    IslandReport report;
    solve_together(island, blocks, world.scene, ends, together, report);
    for (std::size_t i = 0; i < alone.size(); ++i)
      ASSERT_TRUE(identical(alone[i], together[i])) << "body " << i << ", trial " << trial;
    EXPECT_EQ(report.constraint_residual_m_s, whole.constraint_residual_m_s);
    EXPECT_EQ(report.max_penetration_m, whole.max_penetration_m);
    EXPECT_EQ(report.static_impulse_newton_s, whole.static_impulse_newton_s);
  }
}

struct Quality {
  double residual_m_s = 0.0, penetration_m = 0.0, kinetic_joule = 0.0;
};

World pyramid(std::uint64_t seed) {
  World world = test::under_gravity();
  world.scene.solver.direct = false;
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  std::mt19937_64 random(seed);
  const auto off = [&random] { return 0.01 * (static_cast<double>(random() % 1000) / 1000 - 0.5); };
  for (int row = 0; row < 15; ++row)
    for (int i = 0; i < 15 - row; ++i)
      world.add_body(box, Vec3(i * 1.02 + row * 0.51 + off(), off(), 0.5 + row));
  return world;
}

// Means over the last steps of a pile whose largest island is solved as one block, or in blocks.
Quality quality_of(bool in_blocks, World world) {
  constexpr int kSteps = 90, kSettled = 45;
  Quality sum;
  for (int step = 0; step < kSteps; ++step) {
    const Island island = largest_island(world);
    const IslandBlocks blocks =
        in_blocks ? split_island(island.ids, island.manifolds) : one_block(island);
    std::vector<BodyState> states = island.states;
    IslandReport report;
    std::vector<AdvanceFault> faults;
    advance_blocks(
        {world.scene, world.scene.dt_s, island.ids, island.manifolds, island.states, blocks},
        states, report, world.counters, faults);
    world.run(1);  // all others
    for (std::size_t i = 0; i < island.ids.size(); ++i)
      world.states[index_of(island.ids[i])] = states[i];
    if (step < kSettled) continue;
    sum.residual_m_s += report.constraint_residual_m_s / (kSteps - kSettled);
    sum.penetration_m = std::max(sum.penetration_m, report.max_penetration_m);
    sum.kinetic_joule += world.mechanics().kinetic_energy_joule / (kSteps - kSettled);
  }
  return sum;
}

// Impacts may have left a part of the step only.
TEST(LargeIslands, BlocksMoveByThePartOfTheStepThatIsLeft) {
  World world = trough(30);
  world.run(10);
  const Island island = largest_island(world);
  const Geometry geometry(world.scene);
  const auto after = [&](const SceneDescription& scene, double dt_s) {
    std::vector<BodyState> states = island.states;
    SolveScratch scratch;
    std::vector<AdvanceFault> faults;
    advance_once({scene, geometry, dt_s, island.ids, island.manifolds}, Exactness::kOngoing, states,
                 {scratch, world.counters, faults});
    EXPECT_TRUE(faults.empty());
    return states;
  };
  SceneDescription third = world.scene;
  third.dt_s = world.scene.dt_s / 3;
  const std::vector<BodyState> part = after(world.scene, third.dt_s),
                               whole = after(third, third.dt_s);
  EXPECT_GT(world.counters.islands_in_blocks, 0u);
  for (std::size_t i = 0; i < part.size(); ++i) {
    EXPECT_EQ(part[i].position_m, whole[i].position_m) << i;
    EXPECT_EQ(part[i].linear_velocity_m_s, whole[i].linear_velocity_m_s) << i;
  }
}

// Boxes that start within each other, without weight: they are pushed apart, and what iterations
// leave unsolved gives them no speed.
TEST(LargeIslands, OverlapGivesNoEnergy) {
  for (const double restitution : {0.0, 0.5, 1.0})
    for (const double spacing_m : {0.5, 0.8, 0.95}) {
      World world;
      world.scene.solver.direct = false;
      const std::uint32_t box = world.add_shape(Box{});
      for (int i = 0; i < 216; ++i) world.add_body(box, spacing_m * Vec3(i % 6, i / 6 % 6, i / 36));
      world.states[7].linear_velocity_m_s = Vec3(1.0, 0.5, 0.2);
      const double energy_joule = world.mechanics().kinetic_energy_joule;
      for (int step = 0; step < 20; ++step) {
        world.run(1);
        EXPECT_LE(world.mechanics().kinetic_energy_joule, energy_joule * (1.0 + 1e-12))
            << restitution << ' ' << spacing_m << ", step " << step;
      }
      EXPECT_GT(world.counters.islands_in_blocks, 0u);
    }
}

TEST(LargeIslands, BlocksSolveAPileAsWellAsOneBlock) {
  Quality whole, cut;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Quality a = quality_of(false, pyramid(seed)), b = quality_of(true, pyramid(seed));
    whole.residual_m_s += a.residual_m_s;
    cut.residual_m_s += b.residual_m_s;
    whole.penetration_m += a.penetration_m;
    cut.penetration_m += b.penetration_m;
    whole.kinetic_joule += a.kinetic_joule;
    cut.kinetic_joule += b.kinetic_joule;
  }
  EXPECT_LE(cut.residual_m_s, whole.residual_m_s);
  // Contacts are soft while an iteration presses, and the order of rows decides how much of a load
  // each iteration brings down: 1.45 mm instead of 1.26.
  EXPECT_LE(cut.penetration_m, 1.2 * whole.penetration_m);
  EXPECT_LE(cut.kinetic_joule, whole.kinetic_joule);
  EXPECT_GT(whole.residual_m_s, 0.0);
}

TEST(LargeIslands, ReboundsAcrossBordersLoseNoMomentumAndGainNoEnergy) {
  World world = trough(30, {0.3, 0.5});
  const auto energy = [&world] {
    const Mechanics m = world.mechanics();
    return m.kinetic_energy_joule + m.potential_energy_joule;
  };
  for (BodyState& state : world.states) state.linear_velocity_m_s.z() = -2.0;
  double last = energy();
  for (int step = 0; step < 30; ++step) {
    world.run(1);
    EXPECT_LE(energy(), last * (1.0 + 1e-3)) << "step " << step;
    last = energy();
  }
  EXPECT_GT(world.counters.islands_in_blocks, 0u);
  EXPECT_GT(world.counters.restitution_rows, 0u);
}

TEST(LargeIslands, OnlyLargeOnesAreCut) {
  World small = trough(5), large = trough(30);
  small.run(30);
  large.run(30);
  EXPECT_EQ(small.counters.blocks_solved, 0u);
  EXPECT_EQ(small.counters.block_row_sweeps, 0u);
  EXPECT_GT(large.counters.islands_in_blocks, 0u);
  EXPECT_GE(large.counters.blocks_solved, 4 * large.counters.islands_in_blocks);
}

}  // namespace
}  // namespace soda::physics
