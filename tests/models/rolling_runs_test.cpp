// Rolling and torsional friction in divided runs: the same bits as in one world.
#include <gtest/gtest.h>

#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::Material;
using physics::Vec3;

// Balls and boxes that fall, roll and pile up across the borders of worlds.
test::Scene rolling_scene(std::uint64_t seed, int bodies) {
  test::Choices choices(seed);
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground({0.6, 0.0, 0.02, 0.01});
  const std::uint32_t box = scene.shape(physics::Box{Vec3(0.2, 0.25, 0.2)});
  const std::uint32_t ball = scene.shape(physics::Sphere{0.25});
  for (int i = 0; i < bodies; ++i) {
    const Material material{0.5, i % 5 == 0 ? 0.3 : 0.0, i % 2 == 0 ? 0.03 : 0.0,
                            i % 3 == 0 ? 0.02 : 0.0};
    scene.body(i % 4 == 0 ? box : ball, choices.vector(-2.0, 2.0) + Vec3(0, 0, 2.3 + 0.02 * i),
               choices.vector(-3.0, 3.0), material);
    scene.states.back().angular_velocity_rad_s = choices.vector(-5.0, 5.0);
  }
  return scene;
}

TEST(RollingRuns, HaveTheSameBitsHoweverTheyAreDivided) {
  constexpr std::int64_t kSteps = 90;
  for (const int bodies : {24, 160}) {
    const test::Scene scene = rolling_scene(static_cast<std::uint64_t>(bodies), bodies);
    const RunOutcome whole = run(scene, blocks(1), {.steps = kSteps});
    ASSERT_GT(whole.result.stages.rolling_rows, 0u);
    std::uint64_t rollbacks = 0;
    for (const std::uint32_t worlds : {2u, 4u}) {
      for (const bool gating : {true, false}) {
        RunOptions options{.executor = ExecutorKind::kThreads, .threads = 3, .steps = kSteps};
        options.gating = gating;
        const RunOutcome divided = run(scene, blocks(worlds), options);
        EXPECT_EQ(divided.digests, whole.digests) << worlds << " worlds, gating " << gating;
        rollbacks += divided.result.events.rollbacks;
      }
      const RunOutcome sequential = run(scene, blocks(worlds), {.steps = kSteps});
      EXPECT_EQ(sequential.digests, whole.digests) << worlds;
    }
    EXPECT_GT(rollbacks, 0u) << "nothing was repeated";
  }
}

// A user gives bodies rolling friction under way, and takes it again.
TEST(RollingRuns, TakeChangesOfMaterialAlike) {
  test::Scene scene = rolling_scene(3, 12);
  RunOptions options{.steps = 60};
  for (std::uint32_t i = 0; i < 12; ++i) {
    UserInput input;
    input.id = i;
    input.step = 5 + 4 * i;
    input.kind = InputKind::kChangeMaterial;
    input.body = physics::BodyId{i};
    input.material = {0.5, 0.0, 0.01 * i, 0.02 * (i % 3)};
    options.inputs.script.push_back(input);
  }
  const RunOutcome whole = run(scene, blocks(1), options);
  const RunOutcome plain = run(scene, blocks(1), {.steps = 60});
  EXPECT_NE(whole.digests, plain.digests);
  options.executor = ExecutorKind::kThreads;
  options.threads = 3;
  EXPECT_EQ(run(scene, blocks(4), options).digests, whole.digests);
}

}  // namespace
}  // namespace soda::models
