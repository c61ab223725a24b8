// Joints in a scenario: what becomes of them, and what is wrong with them.
#include "scenarios/joints.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "physics/step/step.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::scenarios {
namespace {

std::string scene_with(const std::string& joints, const std::string& more = "") {
  return R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 5,
"materials": [{"name": "m", "friction": 0, "restitution": 0}],
"bodies": [
{"id": 7, "shape": {"type": "sphere", "radius_m": 1}, "mass_kg": 1, "material": "m",
 "position_m": [1, 0, 0], "orientation": {"axis": [0, 0, 1], "angle_deg": 90}},
{"id": 3, "shape": {"type": "sphere", "radius_m": 0.5}, "mass_kg": 1, "material": "m",
 "position_m": [4, 0, 0]},
{"id": 9, "shape": {"type": "sphere", "radius_m": 0.5}, "mass_kg": 1, "material": "m",
 "position_m": [9, 0, 0], "present": false}],)" +
         more + "\"joints\": [" + joints + "]}";
}

std::string faults_of(const std::string& text) {
  try {
    read_scenario_text(text, "a.json", {});
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(JointsOfAScenario, AreInTheFramesOfTheirBodiesLowerIdFirst) {
  const Scenario scenario =
      read_scenario_text(scene_with(R"({"id": 1, "type": "slider", "body": 7, "other_body": 3,
                     "anchor_m": [2, 0, 0], "axis": [0, 0, 5], "can_collide": true})"),
                         "a.json", {});
  ASSERT_EQ(scenario.scene.joints.size(), 1u);
  const physics::Joint& joint = scenario.scene.joints[0];
  EXPECT_EQ(joint.kind, physics::JointKind::kSlider);
  EXPECT_EQ(joint.a, physics::BodyId{0}) << "body 3";
  EXPECT_EQ(joint.b, physics::BodyId{1}) << "body 7";
  EXPECT_LT((joint.anchor_a_m - physics::Vec3(-2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((joint.anchor_b_m - physics::Vec3(0, -1, 0)).norm(), 1e-15) << "it is turned";
  EXPECT_TRUE(joint.collides);
  EXPECT_EQ(scenario.scene.bodies[0].joints, 1u);
  EXPECT_EQ(scenario.scene.bodies[2].joints, 0u);
}

TEST(JointsOfAScenario, WithTheWorldAreAtTheirAnchorAndSpringsRestAsTheyStart) {
  const Scenario scenario =
      read_scenario_text(scene_with(R"({"id": 1, "type": "spring", "body": 3, "anchor_m": [4, 0, 0],
                     "other_anchor_m": [4, 0, 2], "stiffness_newton_m": 10})"),
                         "a.json", {});
  const physics::Joint& joint = scenario.scene.joints.at(0);
  EXPECT_EQ(joint.b, physics::kWorldBody);
  EXPECT_EQ(joint.anchor_b_m, physics::Vec3(4, 0, 2));
  EXPECT_EQ(joint.length_m, 2.0);
  EXPECT_EQ(joint.damping_newton_s_m, 0.0);
}

// Limits and motor are those of the body against the other one, about the axis of the file.
// A body on a spring of 10 N/m under another one, for 4 s.
std::string hung(double mass_kg, double gravity_m_s2) {
  return R"({"format": 1, "time_step_s": 0.01, "steps": 400, "gravity_m_s2": [0, 0, )" +
         std::to_string(-gravity_m_s2) + R"(],
"materials": [{"name": "m", "friction": 0, "restitution": 0}],
"bodies": [
{"id": 0, "shape": {"type": "sphere", "radius_m": 0.1}, "mass_kg": 1, "material": "m",
 "position_m": [0, 0, 0]},
{"id": 1, "shape": {"type": "sphere", "radius_m": 0.1}, "material": "m",
 "position_m": [0, 0, -1], "mass_kg": )" +
         std::to_string(mass_kg) + R"(}],
"joints": [{"id": 1, "type": "ball", "body": 0, "anchor_m": [0, 0, 0]},
           {"id": 2, "type": "spring", "body": 1, "other_body": 0, "anchor_m": [0, 0, -1],
            "other_anchor_m": [0, 0, 0], "stiffness_newton_m": 10}]})";
}

TEST(JointsOfAScenario, SpringsReachAsFarAsTheirBodiesSwingOutWithinTheRun) {
  const auto reach_m = [](double mass_kg, double gravity_m_s2) {
    return read_scenario_text(hung(mass_kg, gravity_m_s2), "a.json", {}).scene.joints.at(0).reach_m;
  };
  const double least_m = 1.0 + 4.0 * 0.1612;
  EXPECT_NEAR(reach_m(1e-3, 10.0), 1.0 + 2.0 * 10.0 / 10.0, 1e-9) << "of the heavier body";
  EXPECT_NEAR(reach_m(5.0, 10.0), 1.0 + 2.0 * 50.0 / 10.0, 1e-9);
  EXPECT_NEAR(reach_m(1e6, 10.0), 1.0 + 0.5 * 10.0 * 4.0 * 4.0, 1e-9) << "it falls no farther";
  EXPECT_NEAR(reach_m(5.0, 0.0), least_m, 1e-3) << "nothing pulls";
}

TEST(JointsOfAScenario, ABodyThatHangsOnASoftSpringIsNotLost) {
  Scenario scenario = read_scenario_text(hung(20.0, 9.81), "a.json", {});
  const physics::Geometry geometry(scenario.scene);
  const std::vector<physics::BodyId> ids{physics::BodyId{0}, physics::BodyId{1}};
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  double lowest_m = 0.0;
  for (int step = 0; step < 400; ++step) {
    physics::step(scenario.scene, geometry, ids, scenario.initial, {scratch, report, counters});
    ASSERT_TRUE(report.faults.empty()) << "step " << step << ": " << report.faults[0].what;
    lowest_m = std::min(lowest_m, scenario.initial[1].position_m.z());
  }
  EXPECT_LT(lowest_m, -30.0) << "to where it swings out";
}

TEST(JointsOfAScenario, SlidersReachAsFarAsTheirMotorDrivesThem) {
  const Scenario scenario =
      read_scenario_text(scene_with(R"({"id": 1, "type": "slider", "body": 7, "other_body": 3,
                     "anchor_m": [2, 0, 0], "axis": [0, 0, 1], "motor_speed_m_s": -400,
                     "motor_force_newton": 5})"),
                         "a.json", {});
  EXPECT_DOUBLE_EQ(scenario.scene.joints.at(0).reach_m, 400.0 * 5 * 0.01);
}

TEST(JointsOfAScenario, LimitsAndMotorsAreOfTheHigherBodyAgainstTheLower) {
  const auto joint = [](const char* body, const char* axis) {
    return read_scenario_text(
               scene_with(R"({"id": 1, "type": "slider", "anchor_m": [2, 0, 0], "min_way_m": -0.25,
                     "max_way_m": 1.5, "motor_speed_m_s": 2, "motor_force_newton": 30, )" +
                          std::string(body) + R"(, "axis": )" + axis + "}"),
               "a.json", {})
        .scene.joints.at(0);
  };
  struct Expected {
    const char *body, *axis;
    bool same;
  };
  for (const Expected& expected : {Expected{R"("body": 7, "other_body": 3)", "[0, 0, 5]", true},
                                   Expected{R"("body": 7, "other_body": 3)", "[0, 1, -5]", false},
                                   Expected{R"("body": 3, "other_body": 7)", "[0, 0, 5]", false},
                                   Expected{R"("body": 3)", "[0, 0, 5]", false},
                                   Expected{R"("body": 3)", "[0, 1, -5]", true}}) {
    const physics::Joint found = joint(expected.body, expected.axis);
    EXPECT_EQ(found.limits->least, expected.same ? -0.25 : -1.5) << expected.body << expected.axis;
    EXPECT_EQ(found.limits->most, expected.same ? 1.5 : 0.25);
    EXPECT_EQ(found.motor->speed, expected.same ? 2.0 : -2.0);
    EXPECT_EQ(found.motor->most_push, 30.0);
    EXPECT_GT(found.reach_m, 1.5);
  }
}

TEST(JointsOfAScenario, AMotorHasASpeedAndAPush) {
  const std::string faults = faults_of(scene_with(R"(
{"id": 1, "type": "hinge", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 1],
 "motor_speed_rad_s": 2},
{"id": 2, "type": "hinge", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 1],
 "max_angle_rad": 4}, {"id": 3, "type": "slider", "body": 3, "anchor_m": [0, 0, 0],
 "axis": [0, 0, 1], "motor_force_newton": 2})"));
  EXPECT_NE(faults.find("/joints/1/max_angle_rad: found 4"), std::string::npos) << faults;
  const std::string motors = faults_of(scene_with(R"(
{"id": 1, "type": "hinge", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 1],
 "motor_speed_rad_s": 2}, {"id": 3, "type": "slider", "body": 3, "anchor_m": [0, 0, 0],
 "axis": [0, 0, 1], "motor_force_newton": 2})"));
  for (const char* part :
       {"/joints/0/motor_speed_rad_s: found motor_speed_rad_s without motor_torque_newton_m",
        "/joints/1/motor_force_newton: found motor_force_newton without motor_speed_m_s"})
    EXPECT_NE(motors.find(part), std::string::npos) << part << "\nin\n" << motors;
}

TEST(JointsOfAScenario, AServoTakesItsTargetAboutTheAxisOfTheFile) {
  for (const bool down : {false, true}) {
    const Scenario scenario = read_scenario_text(
        scene_with(std::string(R"({"id": 4, "type": "hinge", "body": 3, "anchor_m": [0, 0, 0],
 "min_angle_rad": -1, "max_angle_rad": 2, "motor_speed_rad_s": 3, "motor_torque_newton_m": 9,
 "motor_target_rad": 1.5, "axis": [0, 0, )") +
                   (down ? "-1]}" : "1]}") + R"(], "inputs": [{"id": 7, "type": "set-motor",
 "step": 3, "joint": 4, "motor_target_rad": -0.5, "motor_torque_newton_m": 2})"),
        "a.json", {});
    const physics::Joint& joint = scenario.scene.joints.at(0);
    // The world against the body, about the axis that points up.
    const double sign = down ? 1.0 : -1.0;
    EXPECT_EQ(joint.motor->target, sign * 1.5);
    EXPECT_EQ(joint.motor->time_constant_s, 0.1);
    const models::UserInput& input = scenario.run.inputs.script.at(0);
    EXPECT_EQ(input.motor_target, sign * -0.5);
    EXPECT_EQ(input.motor_push, 2.0);
    EXPECT_FALSE(input.motor_speed.has_value());
  }
}

TEST(JointsOfAScenario, TargetsAndTasksOfMotorsAreChecked) {
  const std::string faults = faults_of(scene_with(R"(
{"id": 1, "type": "hinge", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 1],
 "motor_target_rad": 1},
{"id": 2, "type": "slider", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 1],
 "motor_speed_m_s": 1, "motor_force_newton": 1, "motor_time_constant_s": 1},
{"id": 3, "type": "slider", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 1],
 "motor_speed_m_s": 1, "motor_force_newton": 1, "motor_target_m": 2, "max_way_m": 1}],
"inputs": [{"id": 1, "type": "set-motor", "step": 1, "joint": 9, "motor_speed_m_s": 1},
 {"id": 2, "type": "set-motor", "step": 1, "joint": 3, "motor_speed_rad_s": 1},
 {"id": 3, "type": "set-motor", "step": 1, "joint": 3},
 {"id": 4, "type": "set-motor", "step": 1, "joint": 3, "motor_target_m": 1.5})"));
  for (const char* part :
       {"/joints/0/motor_target_rad: found motor_target_rad without a motor",
        "/joints/1/motor_time_constant_s: found motor_time_constant_s without a target",
        "/joints/2/motor_target_m: found 2, which the joint's limits do not let it reach",
        "/inputs/0/joint: found 9, which no motor has",
        "/inputs/1/motor_speed_rad_s: found motor_speed_rad_s for a slider",
        "/inputs/2: found nothing new of the motor",
        "/inputs/3/motor_target_m: found a target that the joint's limits do not let it reach"})
    EXPECT_NE(faults.find(part), std::string::npos) << part << "\nin\n" << faults;
}

TEST(ForcesOfAScenario, AreSharedByBodiesAlikeAndAbsentWithout) {
  const std::string body = R"("shape": {"type": "sphere", "radius_m": 1}, "mass_kg": 1,
    "material": "m")";
  const Scenario scenario = read_scenario_text(
      R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 5,
"materials": [{"name": "m", "friction": 0, "restitution": 0}],
"bodies": [{"id": 1, "position_m": [0, 0, 0], )" +
          body + R"(}, {"id": 2, "position_m": [5, 0, 0], "torque_newton_m": [0, 0, 2],
 "linear_damping_1_s": 0.5, )" +
          body + R"(}], "generators": [{"type": "stack", "first_id": 10, "count": 3,
 "position_m": [9, 0, 0], "force_newton": [1, 2, 3], "body_force_newton": [4, 5, 6],
 "angular_damping_1_s": 0.25, )" +
          body + "}]}",
      "a.json", {});
  ASSERT_EQ(scenario.scene.forces.size(), 2u);
  EXPECT_EQ(scenario.scene.bodies[0].forces, physics::kNone);
  EXPECT_EQ(scenario.scene.bodies[1].forces, 0u);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_EQ(scenario.scene.bodies[i].forces, 1u);
  EXPECT_EQ(
      scenario.scene.forces[0],
      (physics::BodyForces{.torque_newton_m = physics::Vec3(0, 0, 2), .linear_damping_1_s = 0.5}));
  EXPECT_EQ(scenario.scene.forces[1],
            (physics::BodyForces{.body_force_newton = physics::Vec3(4, 5, 6),
                                 .angular_damping_1_s = 0.25}));
  const physics::BodyParams& pushed = scenario.scene.bodies[2];
  EXPECT_LT((pushed.own_field_m_s2 * pushed.mass_kg - physics::Vec3(1, 2, 3)).norm(), 1e-15);
}

TEST(JointsOfAScenario, FaultsAreAllFoundAtOnce) {
  const std::string faults = faults_of(scene_with(R"(
{"id": 1, "type": "ball", "body": 8, "anchor_m": [0, 0, 0]},
{"id": 1, "type": "ball", "body": 3, "anchor_m": [0, 0, 0]},
{"id": 2, "type": "ball", "body": 3, "other_body": 3, "anchor_m": [0, 0, 0]},
{"id": 3, "type": "ball", "body": 9, "anchor_m": [0, 0, 0]},
{"id": 4, "type": "hinge", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 0]},
{"id": 5, "type": "distance", "body": 3, "anchor_m": [0, 0, 0], "other_anchor_m": [0, 0, 0]},
{"id": 6, "type": "distance", "body": 3, "anchor_m": [0, 0, 0], "other_anchor_m": [0, 0, 2],
 "length_m": 2.1})"));
  for (const char* part :
       {"/joints/0/body: found 8, which no body has", "/joints/1/id: found 1 again",
        "/joints/2/other_body: found a joint of a body with itself",
        "/joints/3/body: found 9, a body that is not there yet", "/joints/4/axis: found an axis",
        "/joints/5: found a distance of 0 m",
        "/joints/6/length_m: found 2.1 m between anchors that are 2 m apart"})
    EXPECT_NE(faults.find(part), std::string::npos) << part << "\nin\n" << faults;
}

TEST(JointsOfAScenario, NeedContactResponseAndBodiesThatStay) {
  const std::string ball = R"({"id": 1, "type": "ball", "body": 3, "anchor_m": [0, 0, 0]})";
  EXPECT_NE(faults_of(scene_with(ball, R"("solver": {"contact_response": false},)"))
                .find("contact_response is false"),
            std::string::npos);
  EXPECT_NE(
      faults_of(
          scene_with(ball, R"("inputs": [{"id": 1, "type": "remove", "step": 1, "body": 3}],)"))
          .find("a body that a joint holds"),
      std::string::npos);
}

TEST(JointsOfAScenario, BreakAsTheFileSays) {
  const Scenario scenario = read_scenario_text(scene_with(R"(
{"id": 1, "type": "ball", "body": 3, "anchor_m": [4, 0, 0], "break_force_newton": 12},
{"id": 2, "type": "fixed", "body": 3, "other_body": 7, "anchor_m": [3, 0, 0],
 "break_torque_newton_m": 3},
{"id": 3, "type": "ball", "body": 7, "anchor_m": [1, 0, 0]})"),
                                               "a.json", {});
  const auto joint = [&](std::uint32_t label) {
    return *std::ranges::find(scenario.scene.joints, label, &physics::Joint::label);
  };
  EXPECT_EQ(joint(1).most_force_newton, 12.0);
  EXPECT_FALSE(joint(1).most_torque_newton_m < 1e300);
  EXPECT_FALSE(joint(2).most_force_newton < 1e300);
  EXPECT_EQ(joint(2).most_torque_newton_m, 3.0);
  EXPECT_TRUE(can_break(joint(1)) && can_break(joint(2)));
  EXPECT_FALSE(can_break(joint(3)));
  EXPECT_EQ(scenario.scene.bodies[0].lasting_joints, 0u) << "body 3";
  EXPECT_EQ(scenario.scene.bodies[1].lasting_joints, 1u) << "body 7";
}

TEST(JointsOfAScenario, BreakAtPositiveLoadsThatTheirKindBears) {
  const std::string faults = faults_of(scene_with(R"(
{"id": 1, "type": "hinge", "body": 3, "anchor_m": [4, 0, 0], "axis": [0, 0, 1],
 "break_force_newton": 0, "break_torque_newton_m": -1},
{"id": 2, "type": "ball", "body": 3, "anchor_m": [4, 0, 0], "break_torque_newton_m": 1},
{"id": 3, "type": "fixed", "body": 3, "anchor_m": [4, 0, 0], "breakForce": 1})"));
  for (const char* part :
       {"/joints/0/break_force_newton", "/joints/0/break_torque_newton_m",
        "/joints/1/break_torque_newton_m", "did you mean \"break_force_newton\"?"})
    EXPECT_NE(faults.find(part), std::string::npos) << part << "\nin\n" << faults;
}

}  // namespace
}  // namespace soda::scenarios
