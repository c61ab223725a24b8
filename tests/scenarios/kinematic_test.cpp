// Kinematic bodies in a scenario: their faults, and paths that lead through their way points.
#include "scenarios/kinematic.hpp"

#include <gtest/gtest.h>

#include "physics/math/carried.hpp"
#include "scenarios/orientation.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::scenarios {
namespace {

std::string scene_with(const std::string& body, const std::string& more = "") {
  return R"({"format": 1, "gravity_m_s2": [0, 0, -9.81], "time_step_s": 0.01, "steps": 500,
"materials": [{"name": "m", "friction": 0, "restitution": 0}],
"bodies": [
{"id": 7, "shape": {"type": "box", "size_m": [1, 2, 3]}, "material": "m",
 "position_m": [1, 0, 0], )" +
         body + R"(},
{"id": 9, "shape": {"type": "sphere", "radius_m": 0.5}, "mass_kg": 1, "material": "m",
 "position_m": [9, 0, 0]}])" +
         more + "}";
}

Scenario read(const std::string& body) { return read_scenario_text(scene_with(body), "a.json"); }

std::string faults_of(const std::string& text) {
  try {
    read_scenario_text(text, "a.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void expect_fault(const std::string& text, const std::string& found) {
  EXPECT_NE(faults_of(text).find(found), std::string::npos) << faults_of(text);
}

TEST(KinematicBodiesOfAScenario, HaveNoInverseMass) {
  const Scenario scenario = read(R"("kinematic": true, "velocity_m_s": [1, 0, 0])");
  const physics::BodyParams& body = scenario.scene.bodies.at(0);
  EXPECT_TRUE(body.kinematic);
  EXPECT_EQ(body.inverse_inertia_local, physics::Mat3::Zero());
  EXPECT_FALSE(scenario.scene.bodies.at(1).kinematic);
  EXPECT_FALSE(read(R"("kinematic": false, "mass_kg": 2)").scene.bodies.at(0).kinematic);
}

TEST(KinematicBodiesOfAScenario, HaveNothingThatNeedsAMass) {
  expect_fault(scene_with(R"("kinematic": true, "mass_kg": 2)"), "/bodies/0/mass_kg");
  expect_fault(scene_with(R"("kinematic": true, "density_kg_m3": 2)"), "/bodies/0/density_kg_m3");
  expect_fault(scene_with(R"("kinematic": true, "force_newton": [1, 0, 0])"),
               "/bodies/0/force_newton");
  expect_fault(scene_with(R"("kinematic": true, "linear_damping_1_s": 1)"),
               "/bodies/0/linear_damping_1_s");
  expect_fault(scene_with(R"("kinematic": false)"), "neither mass_kg nor density_kg_m3");
  expect_fault(scene_with(R"("mass_kg": 1, "path": [{"time_s": 0, "position_m": [1, 0, 0]},
                             {"time_s": 1, "position_m": [2, 0, 0]}])"),
               "/bodies/0/path");
  const std::string joint =
      R"(, "joints": [{"id": 1, "type": "ball", "body": 9, "other_body": 7,
                       "anchor_m": [5, 0, 0]}])";
  expect_fault(scene_with(R"("kinematic": true)", joint), "/joints/0/other_body");
  const std::string push = R"(, "inputs": [{"id": 1, "type": "push", "body": 7, "step": 3,
                                            "impulse_newton_s": [1, 0, 0]}])";
  expect_fault(scene_with(R"("kinematic": true)", push), "/inputs/0/body");
}

TEST(KinematicBodiesOfAScenario, HavePathsThatAscendFromTheirStart) {
  const auto path = [](const std::string& points) {
    return scene_with(R"("kinematic": true, "path": [)" + points + "]");
  };
  const std::string start = R"({"time_s": 0, "position_m": [1, 0, 0]})";
  EXPECT_EQ(faults_of(path(start + R"(, {"time_s": 1, "position_m": [2, 0, 0]})")), "");
  expect_fault(path(R"({"time_s": 0.5, "position_m": [1, 0, 0]},
                       {"time_s": 1, "position_m": [2, 0, 0]})"),
               "/bodies/0/path/0/time_s");
  expect_fault(path(R"({"time_s": 0, "position_m": [1, 1, 0]},
                       {"time_s": 1, "position_m": [2, 0, 0]})"),
               "/bodies/0/path/0/position_m");
  expect_fault(path(start + R"(, {"time_s": 1.005, "position_m": [2, 0, 0]})"),
               "/bodies/0/path/1/time_s");
  expect_fault(path(start + R"(, {"time_s": 0, "position_m": [2, 0, 0]})"),
               "/bodies/0/path/1/time_s");
}

// Step by step, as worlds do: the states at the way points are those of the file.
TEST(KinematicBodiesOfAScenario, ComeByTheirWayPoints) {
  const Scenario scenario = read(R"("kinematic": true, "path": [
      {"time_s": 0, "position_m": [1, 0, 0]},
      {"time_s": 1.2, "position_m": [1.5, -3, 7]},
      {"time_s": 1.5, "position_m": [1.5, -3, 7],
       "orientation": {"axis": [1, 2, 3], "angle_deg": 170}},
      {"time_s": 4, "position_m": [100, 0, 0.1],
       "orientation": {"axis": [0, 1, -3], "angle_deg": -50}}])");
  ASSERT_EQ(scenario.run.inputs.script.size(), 3u);
  physics::BodyState state = scenario.initial.at(0);
  std::size_t next = 0, reached = 0;
  FaultList none;
  const auto turned = [&](const Vec3& axis, double angle_deg) {
    AxisAngleSpec spec;
    spec.axis = axis;
    spec.angle_deg = angle_deg;
    spec.sound = true;
    return orientation_of(spec, none);
  };
  const auto expect_at = [&](const Vec3& position, const physics::Quat& orientation) {
    EXPECT_LT((state.position_m - position).norm(), 1e-12);
    EXPECT_LT(turn_between(state.orientation, orientation).norm(), 1e-12);
    ++reached;
  };
  for (std::int64_t step = 0; step <= 500; ++step) {
    if (step == 120) expect_at(Vec3(1.5, -3, 7), physics::Quat::Identity());
    if (step == 150) expect_at(Vec3(1.5, -3, 7), turned(Vec3(1, 2, 3), 170));
    if (step == 400 || step == 500) expect_at(Vec3(100, 0, 0.1), turned(Vec3(0, 1, -3), -50));
    const auto& script = scenario.run.inputs.script;
    if (next < script.size() && script[next].step == step) {
      state.linear_velocity_m_s = script[next].state.linear_velocity_m_s;
      state.angular_velocity_rad_s = script[next++].state.angular_velocity_rad_s;
    }
    state = physics::carried(scenario.scene, physics::BodyId{0}, state, 0.01);
  }
  EXPECT_EQ(reached, 4u);
  EXPECT_EQ(state.linear_velocity_m_s, Vec3(0, 0, 0));
}

}  // namespace
}  // namespace soda::scenarios
