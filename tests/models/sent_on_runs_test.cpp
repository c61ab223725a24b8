// What impacts send on, over several worlds: the bits of the undivided run.
#include <gtest/gtest.h>

#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

// Loose balls, boxes and capsules all over the place, and fast heavy balls.
test::Scene loose_heap(std::uint64_t seed) {
  test::Choices choices(seed);
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  const std::uint32_t ball = scene.shape(physics::Sphere{0.2}),
                      box = scene.shape(physics::Box{Vec3(0.2, 0.2, 0.2)}),
                      capsule = scene.shape(physics::Capsule{0.15, 0.1});
  const double restitution = seed % 3 == 0 ? 0.0 : 0.6;
  for (int x = 0; x < 10; ++x)
    for (int y = 0; y < 6; ++y) {
      const std::uint32_t shape = (x + y) % 3 == 0 ? box : (x + y) % 3 == 1 ? ball : capsule;
      scene.body(shape, Vec3(-2.4 + 0.52 * x, -1.3 + 0.52 * y, 0.26) + choices.vector(-0.02, 0.02),
                 Vec3::Zero(), {.friction = 0.2, .restitution = restitution});
    }
  for (int i = 0; i < 4; ++i)
    scene.body(ball, Vec3(-3.6, -1.2 + 0.8 * i, 0.3), Vec3(12.0 + 4.0 * i, 0, 0),
               {.friction = 0.2, .restitution = restitution});
  return scene;
}

TEST(SentOnRuns, HaveTheSameBitsOverWorldsAndThreads) {
  std::uint64_t again = 0, rolled_back = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const test::Scene scene = loose_heap(seed);
    RunOptions options;
    options.steps = 40;
    const RunOutcome alone = run(scene, blocks(1), options);
    again += alone.result.stages.islands_again;
    for (const ExecutorKind kind :
         {ExecutorKind::kSequential, ExecutorKind::kThreads, ExecutorKind::kVirtual})
      for (const std::uint32_t worlds : {2u, 5u, 16u, 64u}) {
        RunOptions divided = options;
        divided.executor = kind;
        divided.threads = 2;
        divided.scheduling_seed = seed;
        const RunOutcome outcome = run(scene, blocks(worlds), divided);
        rolled_back += outcome.result.events.rolled_back;
        EXPECT_EQ(outcome.digests, alone.digests)
            << worlds << " worlds, executor " << static_cast<int>(kind) << ", seed " << seed;
      }
  }
  EXPECT_GT(again, 50u);
  EXPECT_GT(rolled_back, 100u);
}

// Late ghosts, extrapolations, repetitions and buffers of one entry have nothing to do with it.
TEST(SentOnRuns, HaveTheSameBitsInAllModes) {
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    const test::Scene scene = loose_heap(seed);
    RunOptions options;
    options.steps = 40;
    const RunOutcome alone = run(scene, blocks(1), options);
    options.executor = ExecutorKind::kVirtual;
    options.cluster.check_purity = true;
    options.cluster.processors = 5;
    options.cluster.latency_ns = 20000;
    options.cluster.jitter_ns = 60000;  // ghosts come after what is sent on
    for (const GhostMode ghosts :
         {GhostMode::kReceivedOnly, GhostMode::kDeadReckoning, GhostMode::kPredicted})
      for (const RollbackMode rollback : {RollbackMode::kPropagate, RollbackMode::kInvalidate})
        for (const std::int64_t buffer : {1, 12}) {
          options.ghosts = ghosts;
          options.rollback = rollback;
          options.buffer = buffer;
          options.gating = buffer == 1;
          EXPECT_EQ(run(scene, blocks(12), options).digests, alone.digests)
              << "ghosts " << static_cast<int>(ghosts) << ", rollback "
              << static_cast<int>(rollback) << ", buffer " << buffer << ", seed " << seed;
        }
  }
}

// Pairs of balls on joints in space, where no static makes anybody's box.
test::Scene joined_pairs(std::uint64_t seed) {
  test::Choices choices(seed);
  test::Scene scene(Vec3::Zero());
  const std::uint32_t ball = scene.shape(physics::Sphere{0.15});
  const physics::Material springy{.friction = 0.2, .restitution = 0.5};
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 5; ++y) {
      const Vec3 at = Vec3(-2.4 + 0.75 * x, -1.2 + 0.4 * y, 2.0) + choices.vector(-0.02, 0.02);
      const auto first = static_cast<std::uint32_t>(scene.states.size());
      scene.body(ball, at, Vec3::Zero(), springy);
      scene.body(ball, at + Vec3(0.36, 0, 0), Vec3::Zero(), springy);
      if ((x + y) % 2 == 0) continue;
      physics::Joint joint;
      joint.kind = physics::JointKind::kBall;
      joint.label = static_cast<std::uint32_t>(scene.description.joints.size());
      joint.a = physics::BodyId{first};
      joint.b = physics::BodyId{first + 1};
      joint.anchor_a_m = Vec3(0.18, 0, 0);
      joint.anchor_b_m = Vec3(-0.18, 0, 0);
      joint.reach_m = 0.5;
      scene.description.joints.push_back(joint);
    }
  for (int i = 0; i < 4; ++i)
    scene.body(ball, Vec3(-3.6, -1.1 + 0.5 * i, 2.0), Vec3(8.0 + 4.0 * i, 0.5, 0), springy);
  physics::order_joints(scene.description);
  return scene;
}

TEST(SentOnRuns, HaveTheSameBitsWithJoints) {
  std::uint64_t again = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const test::Scene scene = joined_pairs(seed);
    RunOptions options;
    options.steps = 60;
    const RunOutcome alone = run(scene, blocks(1), options);
    again += alone.result.stages.islands_again;
    for (const ExecutorKind kind : {ExecutorKind::kSequential, ExecutorKind::kVirtual})
      for (const std::uint32_t worlds : {3u, 16u, 64u}) {
        options.executor = kind;
        EXPECT_EQ(run(scene, blocks(worlds), options).digests, alone.digests)
            << worlds << " worlds, executor " << static_cast<int>(kind) << ", seed " << seed;
      }
  }
  EXPECT_GT(again, 20u);
}

// Streams of boxes and balls that cross over a corner of territories.
test::Scene crossing_streams(std::uint64_t seed) {
  test::Choices choices(seed);
  test::Scene scene(Vec3::Zero());
  const std::uint32_t ball = scene.shape(physics::Sphere{0.16}),
                      box = scene.shape(physics::Box{Vec3(0.15, 0.15, 0.15)});
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 3; ++z) {
        const Vec3 at(-3.0 + 0.4 * x, -0.8 + 0.4 * y, 1.2 + 0.4 * z);
        scene.body(box, at + choices.vector(-0.02, 0.02), Vec3(9, 0, 0), {.restitution = 0.8});
        scene.body(ball, Vec3(at.y(), at.x(), at.z()) + choices.vector(-0.02, 0.02), Vec3(0, 11, 0),
                   {.restitution = 0.8});
      }
  return scene;
}

TEST(SentOnRuns, WorldsThatKnowDifferentThingsDoNotAnswerEachOtherForEver) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const test::Scene scene = crossing_streams(seed);
    RunOptions options;
    options.steps = 20;
    const RunOutcome alone = run(scene, blocks(1), options);
    options.executor = ExecutorKind::kVirtual;
    options.gating = false;
    options.cluster.processors = 8;
    options.cluster.latency_ns = 60000;
    const RunOutcome divided = run(scene, blocks(8), options);
    EXPECT_EQ(divided.digests, alone.digests);
    EXPECT_LT(divided.result.events.rolled_back, 25 * divided.result.events.committed) << seed;
  }
}

}  // namespace
}  // namespace soda::models
