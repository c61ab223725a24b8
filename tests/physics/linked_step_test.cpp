// What joints draw along within a step meets what is in its way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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

// A plank comes down on the floor with one end, and something as fast just above that end: they do
// not approach each other before the floor stops the plank, within the step.
World seesaw_that_is_stopped(double ratio, double speed_m_s, int rate) {
  World world = under_gravity();
  world.scene.dt_s = 1.0 / rate;
  world.add_floor();
  const double displacement_m = 0.5 * speed_m_s / rate;
  const Vec3 plank(1.0, 0.3, 0.05), box(0.1, 0.1, 0.1);
  const double pivot_m = 0.3, slope = std::asin((pivot_m - 0.05 - displacement_m) / 1.0);
  const Quat rotation = test::about(Vec3::UnitY(), slope);
  world.add_body(world.add_shape(Box{plank}), Vec3(0, 0, pivot_m), 100.0).orientation = rotation;
  world.states[0].angular_velocity_rad_s = Vec3(0, speed_m_s, 0);
  test::add(world,
            test::joint_at(JointKind::kHinge, world, 0, {}, Vec3(0, 0, pivot_m), Vec3::UnitY()));
  const Vec3 over =
      Vec3(0, 0, pivot_m) + rotation * Vec3(0.8, 0, 0.15 + 0.25 * displacement_m + 0.005);
  const double density = ratio * 100.0 * plank.prod() / box.prod();
  BodyState& falling = world.add_body(world.add_shape(Box{box}), over, density);
  falling.orientation = rotation;
  falling.linear_velocity_m_s =
      world.states[0].angular_velocity_rad_s.cross(Vec3(over - world.states[0].position_m));
  return world;
}

TEST(LinkedStep, WhatFallsAlongWithALeverThatIsStoppedDoesNotSinkIntoIt) {
  for (const double ratio : {0.1, 1.0, 100.0, 1000.0})
    for (const double speed_m_s : {3.0, 6.0, 10.0})
      for (const int rate : {60, 240}) {
        World world = seesaw_that_is_stopped(ratio, speed_m_s, rate);
        double deepest_m = 0.0;
        for (int step = 0; step < rate / 4; ++step) {
          world.run(1);
          for (const ContactManifold& m : test::contacts_of(world, BodyId{0}, BodyId{1}))
            for (std::uint32_t i = 0; i < m.count; ++i)
              deepest_m = std::max(deepest_m, -m.points[i].separation_m);
        }
        EXPECT_LT(deepest_m, 0.003) << ratio << ", " << speed_m_s << " m/s, " << rate;
      }
}

// What hangs beside it and moves along is of no island with it.
TEST(LinkedStep, WhatNoStopCanBringTogetherStaysApart) {
  World world = under_gravity();
  const std::uint32_t rod = world.add_shape(Box{Vec3(0.05, 0.05, 0.5)});
  for (const double x : {0.0, 0.2}) {
    world.add_body(rod, Vec3(x, 0, 0)).angular_velocity_rad_s = Vec3(3, 0, 0);
    const auto body = static_cast<std::uint32_t>(world.states.size() - 1);
    world.states[body].linear_velocity_m_s = Vec3(0, 1.5, 0);
    test::add(world,
              test::joint_at(JointKind::kHinge, world, body, {}, Vec3(x, 0, 0.5), Vec3::UnitX()));
  }
  world.run(30);
  EXPECT_EQ(world.report.islands.size(), 2u);
}

// A chain of capsules that hangs over the floor, and comes down on it and on itself.
World chain_that_falls(std::uint32_t links) {
  World world = under_gravity();
  world.scene.dt_s = 1.0 / 240.0;
  world.add_floor(Material{.friction = 0.5});
  const double apart_m = 0.14;
  const std::uint32_t link = world.add_shape(Capsule{0.02, 0.1});
  for (std::uint32_t i = 0; i < links; ++i)
    world.add_body(link, Vec3(0, 0, 0.3 + apart_m * i), 1000.0, Material{.friction = 0.5});
  for (std::uint32_t i = 1; i < links; ++i)
    test::add(world, test::joint_at(JointKind::kBall, world, i - 1, i,
                                    Vec3(0, 0, 0.3 + apart_m * (i - 0.5))));
  for (std::uint32_t i = 0; i < links; ++i)
    world.states[i].linear_velocity_m_s = Vec3(0.3 * (int(i % 3) - 1), 0.2 * (int(i % 5) - 2), 0);
  return world;
}

TEST(LinkedStep, AChainThatFallsOntoItselfStaysWholeAndHardlySinksIn) {
  for (const std::uint32_t links : {10u, 20u, 30u}) {
    World world = chain_that_falls(links);
    double deepest_m = 0.0, open = 0.0;
    for (int step = 0; step < 300; ++step) {
      world.run(1);
      for (const IslandReport& island : world.report.islands) {
        deepest_m = std::max(deepest_m, island.max_penetration_m);
        open = std::max(open, island.joint_error);
      }
    }
    EXPECT_LT(deepest_m, 0.001) << links;  // of its 0.04
    EXPECT_LT(open, 1e-4) << links;
    EXPECT_LT(world.counters.islands_over_budget, 30u) << links;  // substeps
  }
}

// All of the chain is looked at on its way: no further pass has to connect links of it.
TEST(LinkedStep, AnIslandWithJointsIsAdvancedOnceAStep) {
  World world = chain_that_falls(40);
  world.run(280);
  EXPECT_GT(world.counters.direct_islands, 0u);
  EXPECT_EQ(world.counters.islands_again, 0u);
}

// What a part sinks in by tells how long the next may be: parts are neither tried in vain nor left
// over.
TEST(LinkedStep, WhatHasToBeTakenInPartsTakesFewTrials) {
  World world = chain_that_falls(40);
  std::uint64_t most = 0;
  for (int step = 0; step < 300; ++step) {
    const std::uint64_t before = world.counters.solver_iterations;
    world.run(1);
    most = std::max(most, world.counters.solver_iterations - before);
  }
  EXPECT_LT(most, 800u);
}

}  // namespace
}  // namespace soda::physics
