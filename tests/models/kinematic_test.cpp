// Kinematic bodies that cross territories: the same bits for every executor, through rollbacks.
#include <gtest/gtest.h>

#include <string>

#include "physics/step/step.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

constexpr std::int64_t kSteps = 60;

// A pusher across the whole square, into what stands and slides there; an input turns it round.
test::Scene pushed_scene(std::uint64_t seed, bool first) {
  test::Scene scene(Vec3(0, 0, -9.81));
  const auto add_pusher = [&] {
    const std::uint32_t plate = scene.shape(physics::Box{Vec3(0.2, 2.5, 0.6)});
    scene.body(plate, Vec3(-3.6, 0, 0.7), Vec3(6, 0.5, 0));
    physics::BodyParams& params = scene.description.bodies.back();
    params.kinematic = true;
    params.mass_kg = 1.0;
    params.inertia_local_kg_m2 = physics::Mat3::Identity();
    params.inverse_inertia_local = physics::Mat3::Zero();
  };
  if (first) add_pusher();
  test::Scene others = stack_and_sliders(seed);
  const auto shapes = static_cast<std::uint32_t>(scene.description.shapes.size());
  for (const physics::Shape& shape : others.description.shapes)
    scene.description.shapes.push_back(shape);
  for (std::size_t i = 0; i < others.states.size(); ++i) {
    physics::BodyParams params = others.description.bodies[i];
    params.shape += shapes;
    params.label = static_cast<std::uint32_t>(scene.description.bodies.size());
    scene.description.bodies.push_back(params);
    scene.states.push_back(others.states[i]);
  }
  for (physics::StaticBody fixed : others.description.statics) {
    fixed.shape += shapes;
    scene.description.statics.push_back(fixed);
  }
  if (!first) add_pusher();
  return scene;
}

UserInput turn_round(const test::Scene& scene, bool first) {
  UserInput input;
  input.id = 1;
  input.step = kSteps / 2;
  input.kind = InputKind::kSetVelocity;
  input.body = first ? BodyId{0} : BodyId{static_cast<std::uint32_t>(scene.states.size() - 1)};
  input.sets_linear = input.sets_angular = true;
  input.state.linear_velocity_m_s = Vec3(-4, 0, 0);
  input.state.angular_velocity_rad_s = Vec3(0, 0, 1);
  return input;
}

TEST(KinematicBodies, GiveTheSequentialBitsUnderThreadsThroughRollbacks) {
  std::uint64_t rollbacks = 0, moved = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const bool first = seed % 2 == 0;
    const test::Scene scene = pushed_scene(seed, first);
    RunOptions options{.steps = kSteps};
    options.inputs.script = {turn_round(scene, first)};
    const RunOutcome expected = run(scene, blocks(1), options);
    moved += expected.result.stages.kinematic_bodies;
    EXPECT_EQ(expected.result.stages.kinematic_bodies, static_cast<std::uint64_t>(kSteps));
    for (const std::uint32_t worlds : {4u, 16u}) {
      EXPECT_EQ(run(scene, blocks(worlds), options).digests, expected.digests) << worlds;
      RunOptions threads = options;
      threads.executor = ExecutorKind::kThreads;
      threads.threads = 1 + static_cast<unsigned>(seed % 3);
      threads.buffer = 1 + static_cast<std::int64_t>(seed * 3);
      threads.inputs.at_the_last_moment = true;
      const RunOutcome found = run(scene, blocks(worlds), threads);
      EXPECT_EQ(found.digests, expected.digests) << worlds << " worlds, seed " << seed;
      rollbacks += found.result.events.rollbacks;
      RunOptions cluster = options;
      cluster.executor = ExecutorKind::kVirtual;
      cluster.cluster.processors = 3;
      cluster.cluster.jitter_ns = 20'000;
      EXPECT_EQ(run(scene, blocks(worlds), cluster).digests, expected.digests) << worlds;
    }
  }
  EXPECT_GT(rollbacks, 0u);
  EXPECT_GT(moved, 0u);
}

}  // namespace
}  // namespace soda::models
