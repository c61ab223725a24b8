#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "models/islands/split_messages.hpp"
#include "models/islands/split_plan.hpp"
#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"
#include "physics/step/step.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

// All ways to cut the chain.
std::uint64_t best_by_trial(const std::vector<std::uint64_t>& inside,
                            const std::vector<std::uint64_t>& borders, std::uint32_t solvers) {
  const auto blocks = static_cast<std::uint32_t>(inside.size());
  std::uint64_t best = ~std::uint64_t{0};
  for (std::uint32_t cuts = 0; cuts < (1u << (blocks - 1)); ++cuts) {
    std::vector<SolverRange> ranges{{WorldId{}, 0, 1}};
    for (std::uint32_t block = 1; block < blocks; ++block) {
      if ((cuts >> (block - 1) & 1u) != 0) ranges.push_back({WorldId{}, block, block});
      ranges.back().last = block + 1;
    }
    if (ranges.size() <= solvers) best = std::min(best, largest_work(ranges, inside, borders));
  }
  return best;
}

TEST(SplitPlan, NoCutOfTheChainMakesTheLargestRangeSmaller) {
  test::Choices choices(5);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t blocks = 1 + choices.below(9);
    std::vector<std::uint64_t> inside, borders;
    for (std::size_t i = 0; i < blocks; ++i) inside.push_back(choices.below(300));
    for (std::size_t i = 0; i + 1 < blocks; ++i) borders.push_back(choices.below(100));
    for (std::uint32_t solvers = 1; solvers <= 5; ++solvers) {
      const std::vector<SolverRange> ranges = divide_chain(inside, borders, solvers);
      ASSERT_LE(ranges.size(), solvers);
      ASSERT_EQ(ranges.front().first, 0u);
      ASSERT_EQ(ranges.back().last, blocks);
      for (std::size_t i = 1; i < ranges.size(); ++i)
        ASSERT_EQ(ranges[i].first, ranges[i - 1].last);
      EXPECT_EQ(largest_work(ranges, inside, borders), best_by_trial(inside, borders, solvers));
    }
  }
}

physics::ContactManifold contact(std::uint32_t a, std::uint32_t b) {
  physics::ContactManifold manifold;
  manifold.a = BodyId{a};
  manifold.b = BodyId{b};
  manifold.count = 4;
  return manifold;
}

// Boxes side by side, three abreast; world w owns a piece of the row.
struct Row {
  test::Scene scene;
  std::vector<BodyId> ids;
  std::vector<WorldId> owners;
  std::vector<physics::ContactManifold> manifolds;

  explicit Row(std::uint32_t worlds, double restitution = 0.0) {
    constexpr std::uint32_t kBodies = 240;
    const std::uint32_t box = scene.shape(physics::Box{});
    for (std::uint32_t i = 0; i < kBodies; ++i) {
      scene.body(box, Vec3(i / 3, i % 3, 0), Vec3::Zero(), {0.5, restitution});
      ids.push_back(BodyId{i});
      owners.push_back(WorldId{i * worlds / kBodies});
      if (i % 3 < 2) manifolds.push_back(contact(i, i + 1));
      if (i + 3 < kBodies) manifolds.push_back(contact(i, i + 3));
    }
  }

  std::optional<SplitPlan> plan(const std::vector<std::uint32_t>& processors,
                                std::int64_t exchange_ns = 0) const {
    return plan_split(scene.description, physics::split_island(ids, manifolds), owners, manifolds,
                      processors, exchange_ns);
  }
};

TEST(SplitPlan, EachProcessorGetsTheBlocksWhereItsBodiesAre) {
  const Row row(4);
  const auto plan = row.plan({0, 1, 2, 3});
  ASSERT_TRUE(plan.has_value());
  ASSERT_EQ(plan->solvers.size(), 4u);
  const bool ascends = plan->solvers.front().world == WorldId{0};
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(plan->solvers[i].world, WorldId{ascends ? i : 3 - i});
    EXPECT_GT(plan->solvers[i].last, plan->solvers[i].first);
  }
}

TEST(SplitPlan, WorldsOfOneProcessorHaveOneSolverAndOneProcessorNeedsNone) {
  const Row row(4);
  const auto two = row.plan({0, 0, 1, 1});
  ASSERT_TRUE(two.has_value());
  ASSERT_EQ(two->solvers.size(), 2u);
  for (const SolverRange& range : two->solvers) EXPECT_EQ(index_of(range.world) % 2, 0u);
  EXPECT_FALSE(row.plan({3, 3, 3, 3}).has_value());
}

TEST(SplitPlan, WhatMayBounceIsSolvedAsAWhole) {
  EXPECT_FALSE(Row(4, 0.1).plan({0, 1, 2, 3}).has_value());
}

// 1588 contact points: a sweep takes about 0.14 ms.
TEST(SplitPlan, WhatASweepSavesHasToBeMoreThanTellingTheNeighboursTakes) {
  const Row row(4);
  EXPECT_TRUE(row.plan({0, 1, 2, 3}, 50'000).has_value());
  EXPECT_FALSE(row.plan({0, 1, 2, 3}, 150'000).has_value());
  EXPECT_FALSE(row.plan({0, 0, 1, 1}, 100'000).has_value());
}

TEST(SplitMessages, WhatIsEncodedIsDecoded) {
  test::Choices choices(9);
  {
    BorderNews news{{BodyId{7}, {choices.next(), choices.next()}}, 3, true, {}};
    for (int i = 0; i < 5; ++i) {
      news.bodies.push_back({choices.vector(-1, 1),
                             choices.vector(-1, 1),
                             {choices.vector(-1, 1), choices.vector(-1, 1)}});
    }
    const kernel::Payload payload = encode_border_news(news);
    EXPECT_EQ(island_named_in(payload.bytes()), news.island);
    const BorderNews back = decode_border_news(payload.bytes());
    EXPECT_EQ(back.border, 3u);
    EXPECT_TRUE(back.from_before);
    ASSERT_EQ(back.bodies.size(), news.bodies.size());
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(back.bodies[i].angular, news.bodies[i].angular);
      EXPECT_EQ(back.bodies[i].displacement.linear_m, news.bodies[i].displacement.linear_m);
      EXPECT_EQ(back.bodies[i].displacement.angular_rad, news.bodies[i].displacement.angular_rad);
    }
  }
  WorkNews work{{BodyId{5}, {6, 7}}, 2, std::vector<physics::StepWork>(3)};
  work.work[1].without.add(-2.5);
  work.work[2].driven.half_joule = 1.5;
  const WorkNews received = decode_work_news(encode_work_news(work).bytes());
  EXPECT_EQ(received.island, work.island);
  EXPECT_EQ(received.first, 2u);
  EXPECT_EQ(received.work.at(1).without.sum, -2.5);
  EXPECT_EQ(received.work.at(2).driven.half_joule, 1.5);
  BlockNews news{{BodyId{1}, {2, 3}}, 4, 6, {}, {{BodyId{8}, "position"}}, {}};
  news.bodies.push_back({BodyId{8}, {}});
  news.bodies.back().state.position_m = Vec3(1, 2, 3);
  news.reports.resize(2);
  news.reports[1].static_impulse_newton_s = Vec3(0, 0, 5);
  const BlockNews back = decode_block_news(encode_block_news(news).bytes());
  EXPECT_EQ(back.island, news.island);
  EXPECT_EQ(back.last, 6u);
  EXPECT_EQ(back.bodies.at(0).state.position_m, Vec3(1, 2, 3));
  EXPECT_EQ(back.faults.at(0).what, "position");
  EXPECT_EQ(back.reports.at(1).static_impulse_newton_s, Vec3(0, 0, 5));
}

constexpr std::int64_t kSteps = 7;

// Boxes that drop by 3 mm a layer into a trough along x, over eight worlds: one island once they
// lie.
test::Scene trough(double drop_m = 0.003, int layers = 3) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.description.solver.direct = false;  // else it is solved whole once it is quasi-static
  scene.ground();
  const std::uint32_t wall = scene.shape(physics::Box{Vec3(30, 0.5, 5)});
  for (const double y : {-2.2, 2.2}) {
    physics::StaticBody fixed;
    fixed.shape = wall;
    fixed.position_m = Vec3(0, y, 0);
    scene.description.statics.push_back(fixed);
  }
  const std::uint32_t box = scene.shape(physics::Box{});
  for (int i = 0; i < 60 * layers; ++i) {
    const int x = i % 20, y = i / 20 % 3, z = i / 60;
    scene.body(box, Vec3(1.005 * (x - 9.5) + 0.3 * (z % 2), 1.1 * (y - 1), 0.5 + (1 + drop_m) * z));
  }
  return scene;
}

TerritoryMap eight_worlds() {
  return make_territory_map({Grid{Vec3(-12, -2, 0), 1.0, {24, 4, 6}}, 8, MapKind::kBlocks, 1}, {});
}

struct Outcome {
  std::vector<std::uint64_t> digests;
  std::vector<double> residuals;  // of the largest island of each step
  SimulationResult result;
};

Outcome run(const test::Scene& scene, const RunOptions& options) {
  Outcome outcome;
  const CommitObserver observer{
      .wants_states = true, .on_step = [&](const CommittedStep& step) {
        outcome.digests.push_back(physics::digest(step.ids, step.states));
        double residual = 0.0;
        for (const physics::IslandReport& island : step.islands)
          residual = std::max(residual, island.constraint_residual_m_s + island.contact_points);
        outcome.residuals.push_back(residual);
      }};
  outcome.result = simulate(scene.description, scene.states, eight_worlds(), options, observer);
  return outcome;
}

TEST(SplitIslands, EveryExecutorSolvesALargeIslandTogetherWithTheBitsOfOneSolver) {
  const test::Scene scene = trough();
  const Outcome alone = run(scene, {.steps = kSteps});
  EXPECT_EQ(alone.result.worlds.islands_split, 0u);
  EXPECT_GT(alone.result.stages.islands_in_blocks, 0u);
  std::vector<RunOptions> runs;
  for (const unsigned threads : {2u, 3u, 8u})
    runs.push_back({.executor = ExecutorKind::kThreads,
                    .threads = threads,
                    .steps = kSteps,
                    .buffer = threads == 3 ? 1 : 8,
                    .scheduling_seed = threads == 2 ? 0 : threads});
  for (const unsigned processors : {2u, 5u, 8u}) {
    RunOptions options{.executor = ExecutorKind::kVirtual, .steps = kSteps};
    options.cluster.processors = processors;
    options.cluster.latency_ns = 5000;
    options.cluster.jitter_ns = 10000;
    runs.push_back(options);
  }
  runs.back().rollback = RollbackMode::kInvalidate;
  runs.back().balancing = {BalancingPolicy::kRandom, 3, 1};
  for (const RunOptions& options : runs) {
    const Outcome divided = run(scene, options);
    const std::string which = std::to_string(options.threads) + " threads, " +
                              std::to_string(options.cluster.processors) + " processors";
    EXPECT_EQ(divided.digests, alone.digests) << which;
    EXPECT_EQ(divided.residuals, alone.residuals) << which;
    EXPECT_GT(divided.result.worlds.islands_split, 0u) << which;
  }
}

TEST(SplitIslands, AQuasiStaticLargeIslandIsSolvedDirectlyAndByEachAsAWhole) {
  test::Scene scene = trough(0.0);
  scene.description.solver.direct = true;
  const Outcome alone = run(scene, {.steps = kSteps});
  EXPECT_GT(alone.result.stages.direct_islands, 0u);
  EXPECT_EQ(alone.result.stages.islands_in_blocks, 0u);
  RunOptions options{.executor = ExecutorKind::kThreads,
                     .threads = 3,
                     .steps = kSteps,
                     .buffer = 4,
                     .scheduling_seed = 1};
  const Outcome divided = run(scene, options);
  EXPECT_EQ(divided.digests, alone.digests);
  EXPECT_EQ(divided.result.worlds.islands_split, 0u);
}

// Holds a body to the world where it is.
void hold(std::uint32_t body, test::Scene& scene) {
  physics::Joint joint;
  joint.a = BodyId{body};
  joint.anchor_b_m = scene.states[body].position_m;
  joint.reach_m = 0.1;
  scene.description.joints.push_back(joint);
  physics::order_joints(scene.description);
}

const RunOptions kThreeThreads{
    .executor = ExecutorKind::kThreads, .threads = 3, .steps = kSteps, .buffer = 4};

TEST(SplitIslands, ALargeIslandThatAJointHoldsIsSolvedByEachAsAWhole) {
  for (const double drop_m : {0.0, 0.003}) {
    test::Scene scene = trough(drop_m);
    scene.description.solver.direct = true;
    hold(70, scene);
    const Outcome alone = run(scene, {.steps = kSteps});
    const Outcome divided = run(scene, kThreeThreads);
    EXPECT_GE(*std::max_element(alone.residuals.begin(), alone.residuals.end()), 512.0);
    EXPECT_EQ(divided.digests, alone.digests);
    // What drops is several islands at first, of which only one hangs on the joint.
    if (drop_m == 0.0) {
      EXPECT_EQ(divided.result.worlds.islands_split, 0u);
    }
  }
}

TEST(SplitIslands, AJointElsewhereLeavesALargeIslandToBeSplit) {
  test::Scene scene = trough();
  scene.body(scene.description.bodies.front().shape, Vec3(0, 0, 20));
  hold(180, scene);
  const Outcome alone = run(scene, {.steps = kSteps});
  const Outcome divided = run(scene, kThreeThreads);
  EXPECT_EQ(divided.digests, alone.digests);
  EXPECT_GT(divided.result.worlds.islands_split, 0u);
}

TEST(SplitIslands, WhereContactsHaveNoResponseThereIsNothingToSplit) {
  test::Scene scene = trough();
  scene.description.solver.contact_response = false;
  const Outcome alone = run(scene, {.steps = kSteps});
  const Outcome divided = run(scene, kThreeThreads);
  EXPECT_EQ(divided.digests, alone.digests);
  EXPECT_EQ(divided.result.worlds.islands_split, 0u);
}

TEST(SplitIslands, NobodySplitsWhereNobodyWaitsOrEachSolvesTheWhole) {
  const test::Scene scene = trough();
  const Outcome alone = run(scene, {.steps = kSteps});
  RunOptions options{.executor = ExecutorKind::kVirtual, .steps = kSteps};
  options.cluster.processors = 8;
  options.split_islands = false;
  const Outcome whole = run(scene, options);
  options.split_islands = true;
  options.gating = false;
  const Outcome ungated = run(scene, options);
  for (const Outcome& other : {whole, ungated}) {
    EXPECT_EQ(other.digests, alone.digests);
    EXPECT_EQ(other.result.worlds.islands_split, 0u);
  }
}

// A wall of bricks, each on two.
test::Scene wall(int layers) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.description.solver.direct = false;
  scene.ground();
  const std::uint32_t box = scene.shape(physics::Box{});
  for (int z = 0; z < layers; ++z)
    for (int i = 0; i < layers - z; ++i)
      scene.body(box, Vec3(1.02 * (i - 0.5 * (layers - z - 1)), 0, 0.5 + z));
  return scene;
}

// Sweeps leave so much of a high wall unsolved that its impulses would put in energy: a share of
// them is taken, which follows from all blocks together.
TEST(SplitIslands, AllSolversTakeTheShareOfTheImpulsesThatTheWholeIslandAllows) {
  const test::Scene scene = wall(36);
  const Outcome alone = run(scene, {.steps = 2 * kSteps});
  for (const unsigned processors : {3u, 8u}) {
    RunOptions options{.executor = ExecutorKind::kVirtual, .steps = 2 * kSteps};
    options.cluster.processors = processors;
    const Outcome split = run(scene, options);
    EXPECT_EQ(split.digests, alone.digests);
    EXPECT_EQ(split.residuals, alone.residuals);
    EXPECT_GT(split.result.worlds.islands_split, 0u);
    EXPECT_EQ(split.result.worlds.splits_given_up, 0u);
  }
}

// On eight processors the whole is solved eight times, or split between them once, but for the
// borders that two of them share and for what is done again.
TEST(SplitIslands, SplitTheSweepsAreDoneAboutOnceInsteadOfOnEachProcessor) {
  test::Scene scene = trough(0.0, 8);        // large by the contacts alone that hold something
  scene.description.solver.iterations = 60;  // 30 sweeps: what else a step takes is little to that
  const Outcome alone = run(scene, {.steps = kSteps});
  RunOptions options{.executor = ExecutorKind::kVirtual, .steps = kSteps};
  options.cluster.processors = 8;
  options.cluster.latency_ns = 10000;
  options.split_islands = false;
  const Outcome whole = run(scene, options);
  options.split_islands = true;
  const Outcome split = run(scene, options);
  EXPECT_GT(whole.result.stages.block_row_sweeps, 6 * alone.result.stages.block_row_sweeps);
  EXPECT_LT(split.result.stages.block_row_sweeps, 2 * alone.result.stages.block_row_sweeps);
  EXPECT_LT(2 * split.result.cluster->makespan_ns, whole.result.cluster->makespan_ns);
}

}  // namespace
}  // namespace soda::models
