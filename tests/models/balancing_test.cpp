// Territories that change while a run goes on: the bits do not.
#include "models/load_balancing/balancing.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"
#include "tests/kernel/rank_threads.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

// With a row of boxes that lean on each other.
test::Scene scene_with_row(std::uint64_t seed) {
  test::Scene scene = stack_and_sliders(seed);
  const std::uint32_t box = scene.shape(physics::Box{Vec3(0.3, 0.3, 0.3)});
  for (int i = 0; i < 5; ++i) scene.body(box, Vec3(-1.2 + 0.6 * i, 2.0, 0.3));
  return scene;
}

constexpr std::int64_t kSteps = 90;

RunOutcome undivided(const test::Scene& scene) { return run(scene, blocks(1), {.steps = kSteps}); }

BalancingOptions random_every_ten_steps(std::uint64_t seed) {
  return {.policy = BalancingPolicy::kRandom, .interval = 10, .seed = seed};
}

TEST(Balancing, ARandomHistoryGivesTheBitsOfTheUndividedRunUnderAllExecutors) {
  const test::Scene scene = scene_with_row(1);
  const RunOutcome expected = undivided(scene);
  std::uint64_t seed = 0;
  for (const ExecutorKind executor :
       {ExecutorKind::kSequential, ExecutorKind::kThreads, ExecutorKind::kVirtual}) {
    for (const std::int64_t buffer : {1, 4, 48}) {
      for (const unsigned processors : {2u, 4u}) {
        ++seed;
        const RunOutcome found =
            run(scene, blocks(8),
                {.executor = executor,
                 .threads = processors,
                 .steps = kSteps,
                 .buffer = buffer,
                 .scheduling_seed = seed,
                 .rollback = seed % 2 == 0 ? RollbackMode::kInvalidate : RollbackMode::kPropagate,
                 .gating = seed % 3 != 0,
                 .balancing = random_every_ten_steps(seed),
                 .cluster = {.processors = processors}});
        ASSERT_EQ(found.digests, expected.digests) << "executor " << static_cast<int>(executor)
                                                   << ", buffer " << buffer << ", seed " << seed;
        EXPECT_GT(found.result.territory_changes.size(), buffer < 48 ? 5u : 2u);
        if (executor != ExecutorKind::kSequential && buffer > 1) {
          EXPECT_GT(found.result.events.rollbacks, 0u);
        }
      }
    }
  }
}

TEST(Balancing, ManyRandomHistoriesOfManyScenesGiveTheBitsOfTheUndividedRun) {
  std::size_t changes = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const test::Scene scene = scene_with_row(seed);
    const RunOutcome expected = undivided(scene);
    BalancingOptions balancing = random_every_ten_steps(seed);
    balancing.interval = 1;
    const RunOutcome found = run(scene, blocks(seed % 2 == 0 ? 12 : 3),
                                 {.executor = ExecutorKind::kVirtual,
                                  .steps = kSteps,
                                  .buffer = 6,
                                  .gating = seed % 4 < 2,
                                  .balancing = balancing,
                                  .cluster = {.processors = 3,
                                              .seed = seed,
                                              .latency_ns = 300'000,
                                              .jitter_ns = 300'000,
                                              .gvt_interval_ns = 20'000}});
    ASSERT_EQ(found.digests, expected.digests) << "seed " << seed;
    changes += found.result.territory_changes.size();
  }
  EXPECT_GT(changes, 500u);
}

TEST(Balancing, RanksThatTheRootTellsOfTransfersCommitTheSameBits) {
  const test::Scene scene = scene_with_row(2);
  const RunOutcome expected = undivided(scene);
  for (const BalancingPolicy policy : {BalancingPolicy::kRandom, BalancingPolicy::kPaper}) {
    constexpr std::uint32_t kRanks = 3;
    kernel::RankThreads network(kRanks, 5);
    RunOutcome root;
    {
      std::vector<std::jthread> ranks;
      for (std::uint32_t rank = 0; rank < kRanks; ++rank)
        ranks.emplace_back([&, rank] {
          RunOptions options{.executor = ExecutorKind::kMpi,
                             .threads = 1,
                             .steps = kSteps,
                             .buffer = 4,
                             .balancing = {.policy = policy, .interval = 5},
                             .transport = &network.end(rank)};
          CommitObserver observer{.wants_states = true, .on_step = {}};
          if (rank == 0)
            root = run(scene, blocks(8), options);
          else
            simulate(scene.description, scene.states, blocks(8), options, observer);
        });
    }
    EXPECT_EQ(root.digests, expected.digests);
    EXPECT_GT(root.result.territory_changes.size(), 3u);
    if (policy == BalancingPolicy::kPaper) {
      EXPECT_GT(root.result.worlds.bodies_sampled, 100u);
    }
  }
}

// Bodies at rest, one a cell: who owns them follows from the log of transfers alone. A transfer at
// step k holds from k on; the body stays with its old owner in step k and is the new one's after.
TEST(Balancing, ABodyOfATransferredCellChangesItsOwnerOnceAndIsNeverInTwoWorlds) {
  test::Scene scene;
  const std::uint32_t ball = scene.shape(physics::Sphere{0.2});
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) scene.body(ball, Vec3(x - 3.5, y - 3.5, 0.5));
  const TerritoryMap map = blocks(4);
  std::vector<std::vector<WorldId>> owners;
  const CommitObserver observer{.wants_states = true, .on_step = [&](const CommittedStep& step) {
                                  ASSERT_EQ(step.ids.size(), scene.states.size());
                                  for (std::uint32_t i = 0; i < step.ids.size(); ++i)
                                    ASSERT_EQ(step.ids[i], BodyId{i});
                                  owners.emplace_back(step.owners.begin(), step.owners.end());
                                }};
  const SimulationResult result =
      simulate(scene.description, scene.states, map,
               {.executor = ExecutorKind::kVirtual,
                .steps = 60,
                .buffer = 4,
                .balancing = {.policy = BalancingPolicy::kRandom, .interval = 2, .seed = 9},
                .cluster = {.processors = 4}},
               observer);
  std::size_t bodies_moved = 0;
  for (std::int64_t step = 1; step < 60; ++step) {
    std::vector<CellTransfer> until_before;
    for (const TerritoryChange& change : result.territory_changes)
      if (change.step < step) until_before.push_back({change.cell, change.to});
    const TerritoryMap before = map.after(until_before);
    const std::vector<WorldId>& found = owners[static_cast<std::size_t>(step)];
    for (std::uint32_t i = 0; i < scene.states.size(); ++i) {
      ASSERT_EQ(found[i], before.owner_at(scene.states[i].position_m)) << "step " << step;
      bodies_moved += found[i] != owners[static_cast<std::size_t>(step) - 1][i];
    }
  }
  EXPECT_GT(bodies_moved, 5u);
  EXPECT_EQ(result.worlds.migrations >= bodies_moved, true);
}

// All bodies are in the first world's territory, far from each other, and spin: at rest, they would
// cost nothing that could be shared.
TEST(Balancing, ThePaperSchemeMovesCellsToIdleWorldsAndShortensTheRun) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  const std::uint32_t ball = scene.shape(physics::Sphere{0.2});
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 8; ++y) {
      scene.body(ball, Vec3(x - 3.5, y - 3.5, 0.2));
      scene.states.back().angular_velocity_rad_s = Vec3(0, 0, 5);
    }
  const TerritoryMap map = blocks(2);
  const auto with = [&](BalancingPolicy policy) {
    return run(scene, map,
               {.executor = ExecutorKind::kVirtual,
                .steps = 200,
                .buffer = 8,
                .balancing = {.policy = policy},
                .cluster = {.processors = 2}});
  };
  const RunOutcome off = with(BalancingPolicy::kOff), paper = with(BalancingPolicy::kPaper);
  EXPECT_EQ(off.digests, paper.digests);
  ASSERT_FALSE(paper.result.territory_changes.empty());
  const WorldId loaded = map.owner_at(scene.states[0].position_m);
  for (const TerritoryChange& change : paper.result.territory_changes) {
    EXPECT_EQ(change.from, loaded);
    EXPECT_EQ(change.step, paper.result.territory_changes.front().step) << "balanced at once";
  }
  EXPECT_LT(3 * paper.result.cluster->makespan_ns, 2 * off.result.cluster->makespan_ns);
}

TEST(Balancing, SwitchedOffItSamplesNothingAndMovesNothing) {
  const test::Scene scene = scene_with_row(3);
  const RunOutcome off =
      run(scene, blocks(8), {.executor = ExecutorKind::kVirtual, .steps = kSteps});
  EXPECT_EQ(off.result.worlds.bodies_sampled, 0u);
  EXPECT_TRUE(off.result.territory_changes.empty());
}

TEST(Balancing, AskedOfOneWorldItDoesNothing) {
  const test::Scene scene = scene_with_row(3);
  const RunOutcome one = run(scene, blocks(1),
                             {.executor = ExecutorKind::kVirtual,
                              .steps = kSteps,
                              .balancing = {.policy = BalancingPolicy::kPaper}});
  EXPECT_EQ(one.result.worlds.bodies_sampled, 0u);
  EXPECT_TRUE(one.result.territory_changes.empty());
}

// The part alone: it asks for nothing before GVT + buffer + 1, and holds up nobody.
TEST(Balancing, DecisionsHoldBeyondTheBufferAndTheFloorIsAheadOfGvt) {
  constexpr std::int64_t kBuffer = 6;
  Balancing balancing(random_every_ten_steps(1), std::make_shared<TerritoryMap>(blocks(4)),
                      {0, 1, 2, 3}, kBuffer, 0, 1000);
  for (std::int64_t step = 0; step < 100; ++step) {
    const kernel::VirtualTime gvt = time_of(step, Phase::kPairs);
    std::vector<kernel::Message> messages;
    balancing.take(gvt, gvt, messages);
    EXPECT_EQ(balancing.floor(), time_of(step + kBuffer + 1, Phase::kBegin));
    if (step % 10 == 0) {
      EXPECT_EQ(messages.size() % 4, 0u) << "every world is told";
    } else {
      EXPECT_TRUE(messages.empty());
    }
    for (const kernel::Message& message : messages)
      EXPECT_EQ(message.time, time_of(step + kBuffer + 1, Phase::kBegin));
  }
  EXPECT_GT(balancing.changes().size(), 5u);
}

}  // namespace
}  // namespace soda::models
