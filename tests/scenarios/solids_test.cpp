// Keys of bodies beside shape, mass and place: collision groups, moments of inertia.
#include <gtest/gtest.h>

#include "scenarios/read_scenario.hpp"

namespace soda::scenarios {
namespace {

std::string scene_with(const std::string& of_7, const std::string& of_floor,
                       const std::string& more) {
  return R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 5,
"materials": [{"name": "m", "friction": 0, "restitution": 0}],
"bodies": [
{"id": 7, "shape": {"type": "sphere", "radius_m": 1}, "mass_kg": 1, "material": "m",
 "position_m": [0, 0, 9])" +
         of_7 + R"(},
{"id": 9, "shape": {"type": "sphere", "radius_m": 1}, "mass_kg": 1, "material": "m",
 "position_m": [9, 0, 9]}],
"statics": [{"name": "floor", "shape": {"type": "halfspace", "normal": [0, 0, 1]},
 "material": "m")" +
         of_floor + "}]" + more + "}";
}

std::string faults_of(const std::string& text) {
  try {
    read_scenario_text(text, "a.json", {});
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CollisionGroupsOfAScenario, AreIgnoredInBothDirections) {
  const Scenario scenario = read_scenario_text(
      scene_with(R"(, "collision_group": "ghosts")", R"(, "collision_group": "walls")",
                 R"(, "ignored_collisions": [{"group": "walls", "with": "ghosts"}])"),
      "a.json", {});
  const physics::BodyId floor = physics::static_id(0);
  EXPECT_FALSE(physics::groups_touch(scenario.scene, physics::BodyId{0}, floor));
  EXPECT_TRUE(physics::groups_touch(scenario.scene, physics::BodyId{1}, floor));
  EXPECT_TRUE(physics::groups_touch(scenario.scene, physics::BodyId{0}, physics::BodyId{1}));
}

TEST(CollisionGroupsOfAScenario, OfWhichNothingIsAreFaultsWithTheNearestName) {
  const std::string faults =
      faults_of(scene_with(R"(, "collision_group": "ghosts")", "",
                           R"(, "ignored_collisions": [{"group": "ghost", "with": "ghosts"}])"));
  EXPECT_NE(faults.find("/ignored_collisions/0/group"), std::string::npos) << faults;
  EXPECT_NE(faults.find("did you mean \"ghosts\"?"), std::string::npos) << faults;
}

TEST(MomentsOfInertia, ReplaceThoseOfTheShape) {
  const Scenario scenario = read_scenario_text(
      scene_with(R"(, "principal_inertia_kg_m2": [1, 2, 2.5])", "", ""), "a.json", {});
  EXPECT_EQ(scenario.scene.bodies[0].inertia_local_kg_m2.diagonal(), physics::Vec3(1, 2, 2.5));
  EXPECT_EQ(scenario.scene.bodies[0].inverse_inertia_local.diagonal(), physics::Vec3(1, 0.5, 0.4));
  EXPECT_NEAR(scenario.scene.bodies[1].inertia_local_kg_m2(0, 0), 0.4, 1e-12);
}

TEST(MomentsOfInertia, ThatNoBodyHasAreAFault) {
  const std::string faults =
      faults_of(scene_with(R"(, "principal_inertia_kg_m2": [1, 2, 3.5])", "", ""));
  EXPECT_NE(faults.find("/bodies/0/principal_inertia_kg_m2"), std::string::npos) << faults;
  EXPECT_NE(faults.find("at most the sum of the other two"), std::string::npos) << faults;
}

}  // namespace
}  // namespace soda::scenarios
