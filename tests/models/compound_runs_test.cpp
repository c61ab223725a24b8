// Bodies of several parts over several worlds: the bits of the undivided run.
#include <gtest/gtest.h>

#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::Quat;
using physics::Vec3;

// Tables and dumbbells that fall on each other, on a step of parts and across borders.
test::Scene furniture(std::uint64_t seed) {
  test::Choices choices(seed);
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  const std::uint32_t plate = scene.shape(physics::Box{Vec3(0.4, 0.4, 0.04)}),
                      leg = scene.shape(physics::Box{Vec3(0.04, 0.04, 0.25)}),
                      ball = scene.shape(physics::Sphere{0.15});
  const auto part = [](std::uint32_t shape, const Vec3& position) {
    return physics::CompoundPart{shape, position, Quat::Identity()};
  };
  const std::uint32_t stool =
      scene.shape(physics::Compound{{part(plate, Vec3(0, 0, 0.05)), part(leg, Vec3(-0.3, 0, -0.2)),
                                     part(leg, Vec3(0.3, 0, -0.2))}});
  const std::uint32_t dumbbell =
      scene.shape(physics::Compound{{part(ball, Vec3(-0.35, 0, 0)), part(ball, Vec3(0.35, 0, 0))}});
  for (int i = 0; i < 10; ++i) {
    physics::BodyState& state =
        scene.body(i % 2 == 0 ? stool : dumbbell, choices.vector(-3, 3) + Vec3(0, 0, 4),
                   choices.vector(-6, 6), {.friction = 0.5, .restitution = 0.2});
    state.angular_velocity_rad_s = choices.vector(-5, 5);
  }
  scene.body(dumbbell, Vec3(-3.5, 0.1, 0.8), Vec3(120, 0, 0));
  physics::StaticBody fixed;
  fixed.name = "stool";
  fixed.shape = stool;
  fixed.position_m = Vec3(0.1, -0.1, 0.45);
  scene.description.statics.push_back(fixed);
  return scene;
}

TEST(CompoundRuns, HaveTheSameBitsOverWorldsAndThreads) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const test::Scene scene = furniture(seed);
    RunOptions options;
    options.steps = 90;
    const RunOutcome alone = run(scene, blocks(1), options);
    for (const ExecutorKind kind :
         {ExecutorKind::kSequential, ExecutorKind::kThreads, ExecutorKind::kVirtual})
      for (const std::uint32_t worlds : {2u, 4u, 9u}) {
        RunOptions divided = options;
        divided.executor = kind;
        divided.threads = 2;
        divided.scheduling_seed = seed;
        EXPECT_EQ(run(scene, blocks(worlds), divided).digests, alone.digests)
            << worlds << " worlds, executor " << static_cast<int>(kind);
      }
  }
}

}  // namespace
}  // namespace soda::models
