// What joints draw along within a step meets what is in its way.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::under_gravity;
using test::World;

// A ball at rest on a rod whose other end, a thousand times as heavy, comes down at 400 m/s.
World ball_that_is_drawn_down(double height_m) {
  World world = under_gravity();
  world.add_floor();
  const std::uint32_t ball = world.add_shape(Sphere{0.1}), weight = world.add_shape(Sphere{1.0});
  world.add_body(ball, Vec3(0, 0, height_m));
  world.add_body(weight, Vec3(0, 0, 30)).linear_velocity_m_s = Vec3(0, 0, -400);
  Joint rod = test::joint_at(JointKind::kFixed, world, 0, 1, Vec3(0, 0, height_m));
  rod.reach_m = 100.0;
  test::add(world, rod);
  return world;
}

TEST(LinkedStep, AJointDrawsNoBodyThroughAFloorThatItWasNotSeenToReach) {
  for (const double height_m : {0.2, 1.0, 3.0, 6.0}) {
    World world = ball_that_is_drawn_down(height_m);
    for (int step = 0; step < 5; ++step) {
      world.run(1);
      EXPECT_GE(world.states[0].position_m.z(), 0.1 - 0.002) << height_m << ", step " << step;
    }
    EXPECT_GT(world.counters.impact_searches(), 0u);
  }
}

// A slab that is held before the floor is met as well.
TEST(LinkedStep, AJointDrawsNoBodyThroughAnotherOfItsIsland) {
  World world = ball_that_is_drawn_down(5.0);
  const std::uint32_t slab = world.add_shape(Box{Vec3(2.0, 2.0, 0.1)});
  world.add_body(slab, Vec3(0, 0, 3));
  test::add(world, test::joint_at(JointKind::kFixed, world, 2, {}, Vec3(2, 0, 3)));
  Joint spring = test::joint_at(JointKind::kSpring, world, 1, 2, Vec3(2, 0, 3));
  spring.length_m = 27.0;
  spring.stiffness_newton_m = 1e-3;  // only so that the slab belongs to the island
  spring.reach_m = 100.0;
  test::add(world, spring);
  world.run(3);
  EXPECT_GE(world.states[0].position_m.z(), 3.2 - 0.004);
}

TEST(LinkedStep, WhatIsOnItsWayAsForeseenIsNotLookedForAgain) {
  World world = under_gravity();
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_floor();
  for (const double x : {0.0, 1.0}) world.add_body(ball, Vec3(x, 0, 50));
  test::add(world, test::joint_at(JointKind::kFixed, world, 0, 1, Vec3(0.5, 0, 50)));
  world.run(10);
  EXPECT_EQ(world.counters.impact_searches(), 0u);
}

}  // namespace
}  // namespace soda::physics
