#include "models/run/simulation.hpp"

#include <gtest/gtest.h>

#include "physics/measures/measures.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/step/step.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

// What no executor is involved in: a bare loop over physics::step.
std::vector<std::uint64_t> bare_digests(const test::Scene& scene, std::int64_t steps) {
  const physics::Geometry geometry(scene.description);
  std::vector<BodyId> ids;
  for (std::uint32_t i = 0; i < scene.states.size(); ++i) ids.push_back(BodyId{i});
  std::vector<physics::BodyState> states = scene.states;
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  std::vector<std::uint64_t> digests;
  for (std::int64_t step = 0; step < steps; ++step) {
    scratch.resting.forget();
    physics::step(scene.description, geometry, ids, states, {scratch, report, counters});
    digests.push_back(physics::digest(ids, states));
  }
  return digests;
}

constexpr std::int64_t kSteps = 90;

TEST(Simulation, OneWorldGivesTheBitsOfTheBarePhysicsLoop) {
  const test::Scene scene = busy_scene(1);
  EXPECT_EQ(run(scene, blocks(1), {.steps = kSteps}).digests, bare_digests(scene, kSteps));
}

TEST(Simulation, AnyDivisionInSequenceGivesTheBitsOfTheBarePhysicsLoop) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const test::Scene scene = busy_scene(seed);
    const std::vector<std::uint64_t> expected = bare_digests(scene, kSteps);
    for (const std::uint32_t worlds : {2u, 3u, 8u, 64u, 256u}) {
      const auto [digests, result] = run(scene, blocks(worlds), {.steps = kSteps});
      EXPECT_EQ(digests, expected) << "seed " << seed << ", " << worlds << " worlds";
      EXPECT_GT(result.worlds.migrations, 0u);
      EXPECT_GT(result.worlds.mixed_islands, 0u);
      EXPECT_GT(result.worlds.islands_reused, 0u);
    }
  }
}

TEST(Simulation, OptimisticWorldsRollBackAndStillGiveTheBitsOfTheBarePhysicsLoop) {
  const test::Scene scene = busy_scene(4);
  const std::vector<std::uint64_t> expected = bare_digests(scene, kSteps);
  std::uint64_t rollbacks = 0;
  for (const std::uint32_t worlds : {2u, 8u, 64u}) {
    for (const std::int64_t buffer : {1, 4, 48}) {
      for (const unsigned threads : {1u, 2u, 4u}) {
        for (const std::uint64_t seed : {0u, 1u, 2u}) {
          const auto [digests, result] = run(scene, blocks(worlds),
                                             {.executor = ExecutorKind::kThreads,
                                              .threads = threads,
                                              .steps = kSteps,
                                              .buffer = buffer,
                                              .scheduling_seed = seed});
          ASSERT_EQ(digests, expected)
              << worlds << " worlds, buffer " << buffer << ", " << threads << " threads";
          rollbacks += result.events.rollbacks;
          EXPECT_LT(result.events.lead_max, static_cast<std::uint64_t>(buffer));
        }
      }
    }
  }
  EXPECT_GT(rollbacks, 0u);
}

// A world holds what belongs to the steps from its restart point to the window's end. In a step it
// executes 5 phases and a few merge rounds, fewer than there are worlds; each of them sends at most
// one message to each other world, and gets one.
TEST(Simulation, AWorldsHistoryIsBoundedByItsBufferHoweverLongTheRun) {
  const test::Scene scene = busy_scene(4);
  constexpr std::uint64_t kWorlds = 8;
  const auto bound = [](std::int64_t buffer) {
    const std::uint64_t events_a_step = 5 + kWorlds;
    return static_cast<std::uint64_t>(buffer + 2) * events_a_step * (1 + 2 * (kWorlds - 1));
  };
  for (const ExecutorKind executor : {ExecutorKind::kThreads, ExecutorKind::kVirtual}) {
    std::uint64_t longest = 0;
    for (const std::int64_t buffer : {1, 12}) {
      std::uint64_t shorter_run = 0;
      for (const std::int64_t steps : {kSteps, 5 * kSteps}) {
        const SimulationResult result = run(scene, blocks(kWorlds),
                                            {.executor = executor,
                                             .threads = 2,
                                             .steps = steps,
                                             .buffer = buffer,
                                             .scheduling_seed = 3,
                                             .cluster = {.processors = 4}})
                                            .result;
        EXPECT_LE(result.events.history_max, bound(buffer)) << "buffer " << buffer;
        longest = result.events.history_max;
        // Of threads, the machine decides how far they get between two commits.
        if (executor == ExecutorKind::kVirtual && shorter_run > 0) {
          EXPECT_LE(longest, shorter_run + shorter_run / 4) << "buffer " << buffer;
        }
        shorter_run = longest;
      }
    }
    EXPECT_GT(longest, 12u * 4) << "the buffer was not used";
  }
}

// Two belts that meet in the middle, along borders of most maps, and boxes and balls on both.
test::Scene belts_scene() {
  test::Choices choices(7);
  test::Scene scene(Vec3(0, 0, -9.81));
  const std::uint32_t belt = scene.shape(physics::Box{Vec3(2, 4, 0.5)});
  for (const double side : {-1.0, 1.0}) {
    scene.description.statics.push_back({.name = "belt",
                                         .shape = belt,
                                         .material = {},
                                         .position_m = Vec3(2 * side, 0, -0.5),
                                         .orientation = physics::Quat::Identity(),
                                         .surface_velocity_m_s = Vec3(-side, 0.5 * side, 0)});
  }
  const std::uint32_t box = scene.shape(physics::Box{Vec3(0.3, 0.3, 0.3)});
  const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
  for (int i = 0; i < 16; ++i) {
    scene.body(i % 3 == 0 ? ball : box,
               choices.vector(-3, 3).cwiseProduct(Vec3(1, 1, 0)) + Vec3(0, 0, 0.35 + 0.3 * i));
  }
  return scene;
}

// Two streams of driven balls that cross at the origin, where four territories meet.
test::Scene crossing_scene() {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground({0.0, 0.0});
  const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
  const Vec3 ways[2] = {Vec3(1, 0.1, 0), Vec3(0.1, 1, 0)};
  for (int lane = 0; lane < 2; ++lane) {
    physics::Drive drive;
    drive.lane = physics::Lane{.way_points_m = {Vec3(-3, -3, 0).cwiseProduct(ways[lane]),
                                                Vec3::Zero(), 3.0 * ways[1 - lane]},
                               .half_width_m = 0.4,
                               .speed_m_s = 3.0};
    scene.description.drives.push_back(drive);
    for (int i = 0; i < 8; ++i) {
      scene.body(ball, (-0.6 * i - 0.8) * ways[lane] + Vec3(0.1 * (i % 3), 0.1 * (i % 2), 0.25));
      scene.description.bodies.back().drive = static_cast<std::uint32_t>(lane);
    }
  }
  return scene;
}

// Threads may happen to roll nothing back; the virtual cluster does the same every time.
TEST(Simulation, BeltsAndLanesAcrossBordersGiveTheBitsOfTheBarePhysicsLoop) {
  for (const test::Scene& scene : {belts_scene(), crossing_scene()}) {
    const std::vector<std::uint64_t> expected = bare_digests(scene, kSteps);
    std::uint64_t rollbacks = 0, mixed_islands = 0;
    for (const std::uint32_t worlds : {1u, 2u, 8u, 64u}) {
      for (const auto kind :
           {ExecutorKind::kSequential, ExecutorKind::kThreads, ExecutorKind::kVirtual}) {
        RunOptions options{.executor = kind, .threads = 2, .steps = kSteps, .buffer = 8};
        if (kind == ExecutorKind::kVirtual) {
          options.gating = false;
          options.cluster = {.processors = 4, .latency_ns = 30'000};
        }
        const auto [digests, result] = run(scene, blocks(worlds), options);
        EXPECT_EQ(digests, expected) << worlds;
        EXPECT_GT(result.stages.conveyor_rows + result.stages.driven_bodies, 0u);
        EXPECT_EQ(result.worlds.migrations > 0, worlds > 1) << worlds;
        if (kind == ExecutorKind::kVirtual) rollbacks += result.events.rollbacks;
        mixed_islands += result.worlds.mixed_islands;
      }
    }
    EXPECT_GT(rollbacks, 0u);
    EXPECT_GT(mixed_islands, 0u);
  }
}

TEST(Simulation, FinalStatesAndIslandsAreTheSameForAllExecutors) {
  const test::Scene scene = busy_scene(2);
  std::vector<BodyId> ids;
  for (std::uint32_t i = 0; i < scene.states.size(); ++i) ids.push_back(BodyId{i});
  const SimulationResult one =
      simulate(scene.description, scene.states, blocks(1), {.steps = kSteps});
  const SimulationResult many =
      simulate(scene.description, scene.states, blocks(16),
               {.executor = ExecutorKind::kThreads, .threads = 2, .steps = kSteps, .buffer = 8});
  EXPECT_EQ(physics::digest(ids, many.final_states), physics::digest(ids, one.final_states));
  EXPECT_EQ(many.islands_committed, one.islands_committed);
  EXPECT_EQ(many.committed_steps, kSteps);
}

// A body thrown out of all bounds faults in a definite step, and everything before it is committed.
TEST(Simulation, ANumericalFaultIsTheSameForAllExecutorsAndKeepsWhatCameBefore) {
  test::Scene scene = busy_scene(3);
  scene.body(scene.shape(physics::Sphere{0.1}), Vec3(2, 2, 1e12 - 8e7), Vec3(0, 0, 6e8));
  const auto [expected, sequential] = run(scene, blocks(1), {.steps = 2000});
  ASSERT_TRUE(sequential.fault.has_value());
  EXPECT_EQ(sequential.fault->body_label, scene.description.bodies.back().label);
  EXPECT_EQ(sequential.committed_steps, sequential.fault->step);
  EXPECT_GT(sequential.committed_steps, 3) << "nothing came before";
  for (const std::uint64_t seed : {0u, 3u}) {
    const auto [digests, optimistic] = run(scene, blocks(8),
                                           {.executor = ExecutorKind::kThreads,
                                            .threads = 2,
                                            .steps = 2000,
                                            .buffer = 4,
                                            .scheduling_seed = seed});
    ASSERT_TRUE(optimistic.fault.has_value());
    EXPECT_EQ(optimistic.fault->step, sequential.fault->step);
    EXPECT_EQ(optimistic.fault->body_label, sequential.fault->body_label);
    EXPECT_EQ(optimistic.fault->what, sequential.fault->what);
    EXPECT_EQ(digests, expected);
    EXPECT_EQ(static_cast<std::int64_t>(digests.size()), sequential.committed_steps);
  }
}

// Bodies fail in one step, the later ones in the first worlds: the body that is named is that of
// the plain run.
TEST(Simulation, OfTheBodiesThatFailInOneStepTheFirstIsNamedWhicheverWorldItIsIn) {
  test::Scene scene = busy_scene(3);
  const std::uint32_t ball = scene.shape(physics::Sphere{0.1});
  const auto first = static_cast<std::uint32_t>(scene.states.size());
  for (const double x : {30.0, 20.0, 10.0, -2.0})
    scene.body(ball, Vec3(x, 2, 1e12 - 8e7), Vec3(0, 0, 6e8));
  const auto [expected, sequential] = run(scene, blocks(1), {.steps = 2000});
  ASSERT_TRUE(sequential.fault.has_value());
  EXPECT_EQ(sequential.fault->body_label, scene.description.bodies[first].label);
  for (const ExecutorKind executor : {ExecutorKind::kThreads, ExecutorKind::kVirtual}) {
    const auto [digests, optimistic] =
        run(scene, blocks(8), {.executor = executor, .threads = 2, .steps = 2000, .buffer = 4});
    ASSERT_TRUE(optimistic.fault.has_value());
    EXPECT_EQ(optimistic.fault->step, sequential.fault->step);
    EXPECT_EQ(optimistic.fault->body_label, sequential.fault->body_label);
    EXPECT_NE(optimistic.fault->world, WorldId{0});
    EXPECT_EQ(digests, expected);
  }
}

TEST(Simulation, NoStepsMeansTheInitialStates) {
  const test::Scene scene = busy_scene(1);
  const SimulationResult result =
      simulate(scene.description, scene.states, blocks(4), {.steps = 0});
  EXPECT_EQ(result.committed_steps, 0);
  ASSERT_EQ(result.final_states.size(), scene.states.size());
  for (std::size_t i = 0; i < scene.states.size(); ++i) {
    EXPECT_TRUE(identical(result.final_states[i], scene.states[i]));
  }
}

}  // namespace
}  // namespace soda::models
