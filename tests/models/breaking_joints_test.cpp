// Joints that break across territories: the same bits for every executor, through rollbacks.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

constexpr std::int64_t kSteps = 60;

void add_joint(test::Scene& scene, std::uint32_t a, physics::BodyId b, const Vec3& anchor,
               double most_force_newton) {
  physics::Joint joint;
  joint.kind = physics::JointKind::kFixed;
  joint.label = static_cast<std::uint32_t>(scene.description.joints.size());
  joint.a = BodyId{a};
  joint.b = b;
  joint.anchor_a_m = anchor - scene.states[a].position_m;
  joint.anchor_b_m =
      b == physics::kWorldBody ? anchor : Vec3(anchor - scene.states[index_of(b)].position_m);
  joint.reach_m = 0.5;
  joint.most_force_newton = most_force_newton;
  scene.description.joints.push_back(joint);
}

// A beam of blocks between two walls, across the whole square, on which others fall and slide.
test::Scene beam_scene(std::uint64_t seed) {
  test::Choices choices(seed);
  test::Scene scene = stack_and_sliders(seed);
  const std::uint32_t block = scene.shape(physics::Box{Vec3(0.25, 0.5, 0.15)});
  const auto first = static_cast<std::uint32_t>(scene.states.size());
  constexpr std::uint32_t kBlocks = 12;
  const double weight = 9.81 * 1000.0 * 0.5 * 1.0 * 0.3;
  for (std::uint32_t i = 0; i < kBlocks; ++i)
    scene.body(block, Vec3(-2.75 + 0.5 * i, 1.2, 2.6), Vec3::Zero());
  for (std::uint32_t i = 0; i <= kBlocks; ++i) {
    const Vec3 anchor(-3.0 + 0.5 * i, 1.2, 2.6);
    const double most = weight * choices.between(2.0, 60.0);
    if (i == 0 || i == kBlocks)
      add_joint(scene, i == 0 ? first : first + kBlocks - 1, physics::kWorldBody, anchor, most);
    else
      add_joint(scene, first + i - 1, BodyId{first + i}, anchor, most);
  }
  physics::order_joints(scene.description);
  return scene;
}

TEST(BreakingJoints, GiveTheSequentialBitsUnderThreadsThroughRollbacks) {
  std::uint64_t rollbacks = 0, broken = 0, joints = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const test::Scene scene = beam_scene(seed);
    const RunOptions options{.steps = kSteps};
    const RunOutcome expected = run(scene, blocks(1), options);
    broken += expected.result.stages.joints_broken;
    joints += scene.description.joints.size();
    for (const std::uint32_t worlds : {4u, 16u}) {
      EXPECT_EQ(run(scene, blocks(worlds), options).digests, expected.digests) << worlds;
      for (const RollbackMode mode : {RollbackMode::kPropagate, RollbackMode::kInvalidate}) {
        RunOptions threads = options;
        threads.executor = ExecutorKind::kThreads;
        threads.threads = 1 + static_cast<unsigned>(seed % 3);
        threads.buffer = 1 + static_cast<std::int64_t>(seed * 3);
        threads.rollback = mode;
        const RunOutcome found = run(scene, blocks(worlds), threads);
        EXPECT_EQ(found.digests, expected.digests) << worlds << " worlds, seed " << seed;
        rollbacks += found.result.events.rollbacks;
        RunOptions cluster = options;
        cluster.executor = ExecutorKind::kVirtual;
        cluster.rollback = mode;
        cluster.gating = seed % 2 == 0;
        cluster.split_islands = cluster.gating;
        cluster.cluster.processors = 3;
        cluster.cluster.jitter_ns = 20'000;
        const RunOutcome divided = run(scene, blocks(worlds), cluster);
        EXPECT_EQ(divided.digests, expected.digests) << worlds << " worlds, seed " << seed;
        rollbacks += divided.result.events.rollbacks;
      }
    }
  }
  EXPECT_GT(rollbacks, 0u);
  EXPECT_GT(broken, 4u);
  EXPECT_LT(broken, joints);
}

}  // namespace
}  // namespace soda::models
