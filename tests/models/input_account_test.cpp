// What user input changes for good, and when inputs act that come while a run goes on.
#include <gtest/gtest.h>

#include "models/messages/schedule.hpp"
#include "models/user_input/input_feed.hpp"
#include "models/user_input/scene_versions.hpp"
#include "tests/models/divided_runs.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

test::Scene stack_of_three() {
  test::Scene scene;
  for (int i = 0; i < 3; ++i) scene.body(scene.shape(physics::Sphere{0.5}), Vec3(0, 0, i));
  physics::Joint joint;
  joint.kind = physics::JointKind::kHinge;
  joint.motor = physics::JointMotor{.speed = 1.0, .most_push = 10.0, .time_constant_s = 0.3};
  scene.description.joints = {joint};
  physics::order_joints(scene.description);
  return scene;
}

TEST(InputFeed, GivesLateInputsTheEarliestStepAndHoldsGvtAtTheOthers) {
  LiveInputs live;
  InputFeed feed({.absent = {}, .script = {}, .live = &live}, 2, 0, 10);
  std::vector<kernel::Message> out;
  UserInput input;
  input.id = 1;
  input.step = 3;
  live.offer(input);
  input.id = 2;
  input.step = 40;
  live.offer(input);
  EXPECT_EQ(feed.floor(), kernel::kNever);
  feed.take(time_of(5, Phase::kPairs), time_of(5, Phase::kPairs), out);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[0].time, time_of(6, Phase::kBegin));
  EXPECT_EQ(feed.floor(), time_of(40, Phase::kBegin));
  const auto acted = feed.committed(6);
  ASSERT_EQ(acted.size(), 1u);
  EXPECT_EQ(acted[0].asked_step, 3);
  EXPECT_EQ(acted[0].input.step, 6);
  EXPECT_EQ(feed.too_late(), 1u);
}

TEST(SceneVersions, EqualChangesAreOneDescriptionAndOthersAnother) {
  const test::Scene scene = stack_of_three();
  SceneVersions versions(scene.description);
  SceneChanges changes;
  set_material(BodyId{1}, {0.25, 0.5}, changes);
  set_material(BodyId{2}, {0.75, 0.0}, changes);
  const auto one = versions.with(changes), again = versions.with(changes);
  EXPECT_EQ(one, again);
  EXPECT_NE(one, versions.with({}));
  EXPECT_EQ(one->bodies[1].material.friction, 0.25);
  EXPECT_EQ(one->bodies[2].material.friction, 0.75);
  EXPECT_EQ(versions.with({})->bodies[2].material.friction, 0.5);
  set_material(BodyId{1}, {0.25, 0.25}, changes);
  EXPECT_EQ(versions.with(changes)->bodies[1].material.restitution, 0.25);
}

TEST(SceneVersions, HaveTheLastTaskOfAMotorAndWhatNoInputSaysOfIt) {
  const test::Scene scene = stack_of_three();
  SceneVersions versions(scene.description);
  SceneChanges changes;
  EXPECT_EQ(motor_with(scene.description, changes, 0).speed, 1.0);
  UserInput input;
  input.motor_target = 0.5;
  set_motor(0, motor_after(input, motor_with(scene.description, changes, 0)), changes);
  input.motor_target.reset();
  input.motor_push = 4.0;
  set_motor(0, motor_after(input, motor_with(scene.description, changes, 0)), changes);
  const physics::JointMotor& motor = *versions.with(changes)->joints[0].motor;
  EXPECT_EQ(motor.speed, 1.0);
  EXPECT_EQ(motor.most_push, 4.0);
  EXPECT_EQ(motor.target, 0.5);
  EXPECT_EQ(motor.time_constant_s, 0.3);
  EXPECT_EQ(changes.motors.size(), 1u);
  EXPECT_FALSE(scene.description.joints[0].motor->target.has_value());
}

}  // namespace
}  // namespace soda::models
