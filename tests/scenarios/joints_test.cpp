// Joints in a scenario: what becomes of them, and what is wrong with them.
#include "scenarios/joints.hpp"

#include <gtest/gtest.h>

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

TEST(JointsOfAScenario, FaultsAreAllFoundAtOnce) {
  const std::string faults = faults_of(scene_with(R"(
{"id": 1, "type": "ball", "body": 8, "anchor_m": [0, 0, 0]},
{"id": 1, "type": "ball", "body": 3, "anchor_m": [0, 0, 0]},
{"id": 2, "type": "ball", "body": 3, "other_body": 3, "anchor_m": [0, 0, 0]},
{"id": 3, "type": "ball", "body": 9, "anchor_m": [0, 0, 0]},
{"id": 4, "type": "hinge", "body": 3, "anchor_m": [0, 0, 0], "axis": [0, 0, 0]},
{"id": 5, "type": "distance", "body": 3, "anchor_m": [0, 0, 0], "other_anchor_m": [0, 0, 0]})"));
  for (const char* part :
       {"/joints/0/body: found 8, which no body has", "/joints/1/id: found 1 again",
        "/joints/2/other_body: found a joint of a body with itself",
        "/joints/3/body: found 9, a body that is not there yet", "/joints/4/axis: found an axis",
        "/joints/5: found a distance of 0 m"})
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

}  // namespace
}  // namespace soda::scenarios
