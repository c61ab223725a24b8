// Bodies and statics whose groups pass through each other.
#include <gtest/gtest.h>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

constexpr CollisionFilter kGhost{.groups = 1, .ignored_groups = 2};
constexpr CollisionFilter kWall{.groups = 2, .ignored_groups = 0};

TEST(CollisionGroups, WhatIgnoresAStaticFallsThroughItAndTheOthersDoNot) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  world.add_floor();
  world.scene.statics[0].filter = kWall;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.5, 0.5, 0.5)});
  for (int i = 0; i < 3; ++i) world.add_body(box, Vec3(3.0 * i, 0, 0.5));
  world.scene.bodies[1].filter = kGhost;
  world.run(60);
  EXPECT_NEAR(world.states[0].position_m.z(), 0.5, 1e-3);
  EXPECT_NEAR(world.states[1].position_m.z(), 0.5 - 0.5 * kGravity, 1e-9) << "free fall for 1 s";
  EXPECT_NEAR(world.states[2].position_m.z(), 0.5, 1e-3);
}

// In a third body's island, too: all pairs of an island in flight are looked at for impacts.
TEST(CollisionGroups, FlyThroughEachOtherAmongOthersThatBounce) {
  World world;
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_body(ball, Vec3(-0.5, 0, 0)).linear_velocity_m_s = Vec3(30, 0, 0);
  world.add_body(ball, Vec3(0, 0, 0));
  world.add_body(ball, Vec3(0.5, 0, 0));
  for (BodyParams& body : world.scene.bodies) body.material = {.friction = 0.0, .restitution = 1.0};
  world.scene.bodies[0].filter = kGhost;
  world.scene.bodies[1].filter = kWall;
  world.run(6);
  EXPECT_EQ(world.states[1].linear_velocity_m_s, Vec3(0, 0, 0)) << "flown through";
  EXPECT_NEAR(world.states[2].linear_velocity_m_s.x(), 30.0, 1e-9) << "struck";
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), 0.0, 1e-9);
}

}  // namespace
}  // namespace soda::physics
