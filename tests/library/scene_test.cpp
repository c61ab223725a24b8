// Scenes that are loaded, parsed and built.
#include <gtest/gtest.h>

#include "library/arena.hpp"
#include "soda/simulation.hpp"

namespace soda {
namespace {

using library_test::arena;
using library_test::arena_parts;

std::string message_of(const SceneParts& parts) {
  try {
    Scene::build(parts);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

TEST(LibraryScene, TellsWhatIsInIt) {
  const Scene scene = arena();
  EXPECT_EQ(scene.name(), "arena");
  EXPECT_EQ(scene.steps(), 120);
  EXPECT_DOUBLE_EQ(scene.time_step_s(), 1.0 / 120.0);
  EXPECT_EQ(scene.body_ids(), (std::vector<std::uint32_t>{1, 2, 3, 4, 5, 10, 11, 12, 13, 14}));
  EXPECT_EQ(scene.static_names(), std::vector<std::string>{"floor"});
  EXPECT_DOUBLE_EQ(scene.mass_kg(10), 500.0 * 0.125);
  EXPECT_THROW(scene.mass_kg(99), UsageError);
}

TEST(LibraryScene, BuiltOnesAreScenarioFiles) {
  const Scene built = arena(), read = Scene::parse(scene_text(arena_parts()), "arena");
  Simulation a(built), b(read);
  a.step(30);
  b.step(30);
  EXPECT_EQ(a.digest(), b.digest());
}

TEST(LibraryScene, EveryShapeCanBeBuilt) {
  SceneParts parts;
  parts.materials = {{.name = "wood"}};
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  parts.statics = {{.name = "floor", .shape = HalfSpace{}, .material = "wood"},
                   {.name = "wedge",
                    .shape = Mesh{corners, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}},
                    .material = "wood",
                    .position_m = {20.0, 0.0, 0.0}}};
  const std::vector<Shape> solids{
      Sphere{0.5},       Box{{1, 2, 1}},
      Capsule{0.3, 1.0}, Cylinder{0.5, 1.0},
      Hull{corners},     Compound{{{Sphere{0.3}, {0, 0, 0.5}, {}}, {Box{{1, 1, 0.2}}, {}, {}}}}};
  for (std::uint32_t i = 0; i < solids.size(); ++i)
    parts.bodies.push_back({.id = i,
                            .shape = solids[i],
                            .material = "wood",
                            .mass_kg = 1.0,
                            .position_m = {3.0 * i, 0.0, 2.0}});
  Simulation simulation(Scene::build(parts));
  simulation.step(120);
  for (const BodyState& state : simulation.states()) EXPECT_GT(state.position_m.z, 0.0);
}

TEST(LibraryScene, EveryJointCanBeBuilt) {
  SceneParts parts;
  parts.materials = {{.name = "wood"}};
  for (const JointKind kind : {JointKind::kBall, JointKind::kHinge, JointKind::kSlider,
                               JointKind::kFixed, JointKind::kDistance, JointKind::kSpring}) {
    const auto i = static_cast<std::uint32_t>(kind);
    const Vec3 place{3.0 * i, 0.0, 5.0}, above{3.0 * i, 0.0, 6.0};
    parts.bodies.push_back(
        {.id = i, .shape = Box{}, .material = "wood", .mass_kg = 1.0, .position_m = place});
    Joint joint{.id = i, .kind = kind, .body = i, .anchor_m = place, .other_anchor_m = above};
    joint.stiffness_newton_m = 1000.0;
    parts.joints.push_back(joint);
  }
  Simulation simulation(Scene::build(parts));
  simulation.step(60);
  // Only the slider (along z) lets its body fall.
  for (const std::uint32_t body : simulation.body_ids())
    EXPECT_EQ(simulation.state(body).position_m.z < 4.0, body == 2u) << body;
}

TEST(LibraryScene, FaultsAreToldInTheWordsOfScenarios) {
  SceneParts parts = arena_parts();
  parts.bodies[0].material = "wod";
  parts.materials[0].friction = -1.0;
  const std::string message = message_of(parts);
  EXPECT_NE(message.find("/bodies/0/material: found the string \"wod\""), std::string::npos)
      << message;
  EXPECT_NE(message.find("did you mean \"wood\"?"), std::string::npos) << message;
  EXPECT_NE(message.find("/materials/0/friction: found -1; allowed:"), std::string::npos);
  try {
    Scene::build(parts);
    FAIL();
  } catch (const SceneError& error) {
    ASSERT_EQ(error.faults().size(), 2u);
    EXPECT_EQ(error.faults()[0].pointer, "/materials/0/friction");
    EXPECT_GT(error.faults()[0].line, 1u);
  }
}

TEST(LibraryScene, WhatIsNoNumberIsAFault) {
  SceneParts parts = arena_parts();
  parts.bodies[0].mass_kg = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message_of(parts), "");
}

TEST(LibraryScene, WhatAKindOfJointDoesNotHaveIsAFault) {
  SceneParts parts = arena_parts();
  parts.joints[0].kind = JointKind::kBall;
  const std::string message = message_of(parts);
  EXPECT_NE(message.find("motor_speed_rad_s"), std::string::npos) << message;
}

TEST(LibraryScene, FilesThatAreNotThereAreFileErrors) {
  EXPECT_THROW(Scene::load("/nowhere/scene.json"), FileError);
}

TEST(LibraryScene, WarningsAreTold) {
  SceneParts parts = arena_parts();
  parts.bodies[0].position_m = {-2.0, 0.0, -1.0};
  ASSERT_FALSE(Scene::build(parts).warnings().empty());
  EXPECT_NE(Scene::build(parts).warnings()[0].find("below-floor"), std::string::npos);
}

}  // namespace
}  // namespace soda
