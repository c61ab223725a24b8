#include "physics/events/sleeping.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::under_gravity;
using test::World;

World stack_of(int boxes, double gap_m = 0.0) {
  World world = under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < boxes; ++i)
    world.add_body(box, Vec3(i % 2 == 0 ? 0.02 : -0.02, 0, 0.5 + gap_m + i * (1.0 + gap_m)));
  return world;
}

// Steps until nothing has to be solved any more, at most `most`.
int steps_to_rest(World& world, const Geometry& geometry, int most) {
  for (int step = 0; step < most; ++step) {
    const std::uint64_t solved = world.counters.islands_solved;
    world.run(1, geometry);
    if (world.counters.islands_solved == solved) return step;
  }
  return most;
}

std::uint64_t tests_of(const World& world) {
  std::uint64_t sum = 0;
  for (const std::uint64_t tests : world.counters.narrowphase_tests) sum += tests;
  return sum;
}

TEST(Sleeping, AStackAtRestKeepsEveryBitAndNeedsNoTestAndNoSolve) {
  World world = stack_of(10);
  const Geometry geometry(world.scene);
  ASSERT_LT(steps_to_rest(world, geometry, 600), 600);
  const std::vector<BodyState> before = world.states;
  const std::uint64_t tests = tests_of(world), rows = world.counters.normal_rows;
  const std::uint64_t solved = world.counters.islands_solved;
  world.run(100, geometry);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_TRUE(identical(before[i], world.states[i])) << i;
  EXPECT_EQ(tests_of(world), tests);
  EXPECT_EQ(world.counters.normal_rows, rows);
  EXPECT_EQ(world.counters.islands_solved, solved);
  EXPECT_EQ(world.counters.pairs_at_rest % 10, 0u);
  EXPECT_GE(world.counters.pairs_at_rest, 1000u);
}

// It comes to rest from a creep: what that had of momentum goes to the floor.
TEST(Sleeping, WhatStaticsGiveToAnIslandThatComesToRestIsAccountedFor) {
  World world = stack_of(5, 0.01);
  const Geometry geometry(world.scene);
  const double weight = 5 * world.scene.bodies[0].mass_kg * kGravity * world.scene.dt_s;
  for (int step = 0; step < 2000; ++step) {
    const Mechanics before = world.mechanics();
    world.run(1, geometry);
    if (!has_no_velocity(world.states[0])) continue;
    ASSERT_GT(before.momentum_scale_newton_s, 0.0);
    const Vec3 given = world.report.islands.front().static_impulse_newton_s;
    EXPECT_LT((before.linear_momentum_newton_s + given - weight * Vec3::UnitZ()).norm(),
              1e-15 * weight);
    return;
  }
  FAIL() << "never at rest";
}

// Iterations alone leave a sixtieth of its weight, which looks like motion.
TEST(Sleeping, ADominoThatStandsIsSolvedOnceHoweverItIsTurned) {
  for (const Vec3& half_m : {Vec3(0.01, 0.05, 0.1), Vec3(0.01, 0.05, 0.05), Vec3(0.5, 0.1, 0.02)})
    for (int degrees = 3; degrees < 180; degrees += 10) {
      World world = under_gravity();
      world.add_floor({.friction = 0.4});
      world
          .add_body(world.add_shape(Box{half_m}), Vec3(0.3, 0, half_m.z()), 1000.0,
                    {.friction = 0.4})
          .orientation = test::about(Vec3::UnitZ(), degrees * std::numbers::pi / 180.0);
      world.run(3);
      EXPECT_EQ(world.counters.refined_steps, 0u) << degrees;
      EXPECT_EQ(world.counters.islands_solved, 1u) << degrees;
    }
}

TEST(Sleeping, AHitWakesAnIslandAndTheMemoryOfItChangesNoBit) {
  World remembered = stack_of(6);
  remembered.add_body(remembered.add_shape(Sphere{0.2}), Vec3(-40, 0, 2.6)).linear_velocity_m_s =
      Vec3(6, 0, 32.2);
  World forgetful = remembered;
  const Geometry geometry(remembered.scene);
  std::uint64_t at_rest = 0;
  for (int step = 0; step < 900; ++step) {
    remembered.run(1, geometry);
    forgetful.scratch.resting.forget();
    forgetful.run(1, geometry);
    ASSERT_EQ(remembered.digest_of_states(), forgetful.digest_of_states()) << "step " << step;
    if (remembered.report.islands.front().rests) ++at_rest;
  }
  EXPECT_GT(at_rest, 200u);
  EXPECT_LT(remembered.states[6].linear_velocity_m_s.x(), -1.0) << "the ball hit it";
  EXPECT_GT((remembered.states[2].position_m - Vec3(0.02, 0, 2.5)).norm(), 1e-9) << "was woken";
  EXPECT_GT(remembered.counters.pairs_at_rest, 1000u);
  EXPECT_EQ(forgetful.counters.pairs_at_rest, 0u);
}

TEST(Sleeping, APushOfOneBodyWakesAllOfItsIsland) {
  World world = stack_of(3);
  const Geometry geometry(world.scene);
  ASSERT_LT(steps_to_rest(world, geometry, 600), 600);
  world.states[2].linear_velocity_m_s = Vec3(0, 0, 2);
  world.run(1, geometry);
  EXPECT_GT(world.states[2].position_m.z(), 2.52);
  world.states[1].angular_velocity_rad_s = Vec3(0, 0, 1);
  world.run(1, geometry);
  EXPECT_GT(world.states[1].orientation.z(), 1e-3);
}

// The light one is pressed by a million times its weight, and its impulse is found to a share of
// that; the heavy one is not.
TEST(Sleeping, AHeavyBoxThatCreepsOverALightOneGoesOn) {
  World world = under_gravity();
  world.scene.gravity_m_s2 = Vec3(0.002, 0, -kGravity);
  const Material ice{.friction = 0.0};
  world.add_floor({.friction = 10.0});
  const std::uint32_t box = world.add_shape(Box{{0.5, 0.5, 0.1}});
  world.add_body(box, Vec3(0, 0, 0.1), 1.0, {.friction = 10.0});
  world.add_body(box, Vec3(0, 0, 0.3), 1e6, ice);
  world.run(120);
  EXPECT_NEAR(world.states[1].position_m.x(), 0.5 * 0.002 * 4.0, 1e-4);
}

// Bricks in rows, each row shorter by one (a pyramid) or as long as the first, with half bricks at
// the ends of every other one. The last one is pushed down.
World touched_rows(int rows, bool shorter, double gap_m, double dt_s) {
  const Material clay{.friction = 0.6, .restitution = 0.0};
  World world = under_gravity();
  world.scene.dt_s = dt_s;
  world.add_floor(clay);
  const double pitch = 0.3 + gap_m;
  const std::uint32_t brick = world.add_shape(Box{{0.15, 0.075, 0.1}}),
                      half = world.add_shape(Box{{0.25 * (0.3 - gap_m), 0.075, 0.1}});
  for (int row = 0; row < rows; ++row) {
    const bool ends = !shorter && row % 2 != 0;
    const int count = shorter ? rows - row : rows - ends;
    const double z = 0.1 + 0.2 * row;
    for (int i = 0; i < count; ++i)
      world.add_body(brick, Vec3(pitch * (i - 0.5 * (count - 1)), 0, z), 500.0, clay);
    for (const double side : {-0.5, 0.5})
      if (ends) world.add_body(half, Vec3(side * pitch * (rows - 0.5), 0, z), 500.0, clay);
  }
  world.states.back().linear_velocity_m_s = Vec3(0, 0, -1);
  return world;
}

TEST(Sleeping, WallsAndPyramidsThatWereTouchedComeToRest) {
  for (const double dt_s : {1.0 / 60, 1.0 / 120})
    for (const bool shorter : {true, false})
      for (const double gap_m : {0.0, 0.004, 0.02})
        for (const int rows : {6, 9, 12}) {
          World world = touched_rows(rows, shorter, gap_m, dt_s);
          const int most = static_cast<int>(3.0 / dt_s);
          const int steps = steps_to_rest(world, Geometry(world.scene), most);
          EXPECT_LT(steps, most) << dt_s << " " << shorter << " " << gap_m << " " << rows;
          double deepest_m = 0.0;
          for (const IslandReport& island : world.report.islands)
            deepest_m = std::max(deepest_m, island.max_penetration_m);
          EXPECT_LT(deepest_m, 1e-3 * 0.15)
              << dt_s << " " << shorter << " " << gap_m << " " << rows;
        }
}

TEST(Sleeping, WhatIsLeftOfAnIslandIsSolvedWhenABodyIsTakenAway) {
  World world = stack_of(3);
  const Geometry geometry(world.scene);
  ASSERT_LT(steps_to_rest(world, geometry, 600), 600);
  world.ids.erase(world.ids.begin() + 1);
  world.states.erase(world.states.begin() + 1);
  world.run(30, geometry);
  EXPECT_LT(world.states[1].position_m.z(), 2.0) << "the third falls where the second was";
}

// Its impulses hold it from the second step on, but for the overlap.
TEST(Sleeping, AnOverlapIsPushedOutFirst) {
  World world = under_gravity();
  world.add_floor();
  world.add_body(world.add_shape(Sphere{0.5}), Vec3(0, 0, 0.48));
  world.run(300);
  EXPECT_NEAR(world.states[0].position_m.z(), 0.5, 1e-3);
  EXPECT_TRUE(world.report.islands.front().rests);
}

// It rode with the belt, so friction did nothing in the step before.
TEST(Sleeping, ABoxThatIsStoppedOnABeltIsCarriedOn) {
  World world = under_gravity();
  world.add_floor();
  world.scene.statics[0].surface_velocity_m_s = Vec3(1, 0, 0);
  world.add_body(world.add_shape(Box{}), Vec3(0, 0, 0.5));
  world.run(120);
  ASSERT_NEAR(world.states[0].linear_velocity_m_s.x(), 1.0, 1e-9);
  world.states[0].linear_velocity_m_s.setZero();
  world.states[0].angular_velocity_rad_s.setZero();
  world.run(120);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), 1.0, 1e-9);
}

TEST(Sleeping, ASlowBallRollsOn) {
  World world = under_gravity();
  world.add_floor();
  BodyState& ball = world.add_body(world.add_shape(Sphere{0.5}), Vec3(0, 0, 0.5));
  ball.linear_velocity_m_s = Vec3(1e-9, 0, 0);
  ball.angular_velocity_rad_s = Vec3(0, 2e-9, 0);
  world.run(600);
  EXPECT_NEAR(world.states[0].position_m.x(), 1e-8, 1e-12);
}

// Ten times what may be taken for none by a solve of several bodies.
TEST(Sleeping, ATenMillionthOfGravityMovesTwoBodiesThatNothingHolds) {
  World world = under_gravity();
  const double along = 1e-7 * kGravity;
  world.scene.gravity_m_s2.x() = along;
  world.add_floor({.friction = 0.0});
  const std::uint32_t box = world.add_shape(Box{});
  world.add_body(box, Vec3(0, 0, 0.5));
  world.add_body(box, Vec3(0, 0, 1.5));
  world.run(600);
  for (const BodyState& state : world.states)
    EXPECT_NEAR(state.position_m.x() / (0.5 * along * 100.0), 1.0, 0.01);
}

TEST(Sleeping, BodiesInTouchWithoutGravityAreLeftAlone) {
  World world;
  const std::uint32_t box = world.add_shape(Box{});
  world.add_body(box, Vec3(0, 0, 0));
  world.add_body(box, Vec3(1, 0, 0));
  world.run(10);
  EXPECT_EQ(world.counters.islands_solved, 0u);
  EXPECT_EQ(world.counters.islands_at_rest, 10u);
}

TEST(Sleeping, ALargeIslandThatASpringHoldsToTheWorldIsLeftAloneToo) {
  World world;
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 216; ++i) world.add_body(box, Vec3(i % 6, i / 6 % 6, i / 36));
  Joint spring;
  spring.kind = JointKind::kSpring;
  spring.anchor_b_m = world.states[0].position_m;
  spring.stiffness_newton_m = 1.0;
  spring.reach_m = 0.1;
  world.scene.joints = {spring};
  order_joints(world.scene);
  world.run(3);
  EXPECT_EQ(world.counters.islands_at_rest, 3u);
}

// A grid took ten times as much from 7 x 7 on: what it moves by is the rounding of its places.
TEST(Sleeping, WhatHangsStillOnJointsTakesNoSolveHoweverManyTheyAre) {
  for (const std::uint32_t n : {2u, 5u, 7u, 10u}) {
    World world = test::hanging_grid(n);
    world.run(5);
    const std::vector<BodyState> rested = world.states;
    const std::uint64_t solved = world.counters.solver_iterations;
    for (int step = 0; step < 5; ++step) {
      world.run(1);
      ASSERT_EQ(world.report.islands.size(), 1u);
      EXPECT_TRUE(world.report.islands.front().rests) << n;
    }
    EXPECT_EQ(world.counters.solver_iterations, solved) << n;
    for (std::size_t i = 0; i < rested.size(); ++i)
      EXPECT_EQ(world.states[i].position_m, rested[i].position_m) << n << ", body " << i;
    world.states[n * n - 1].linear_velocity_m_s = Vec3(0, 1, 0);
    world.run(1);
    EXPECT_FALSE(world.report.islands.front().rests) << n;
    EXPECT_GT(world.states[n * n - 1].position_m.y(), 0.0) << n;
  }
}

// The impulses that it ends with do not hold it by themselves, but the next step does the same.
TEST(Sleeping, WhatAStepLeavesAsItWasIsNotSolvedAgain) {
  World world = under_gravity();
  world.add_body(world.add_shape(Box{{0.12, 0.12, 0.03}}), Vec3(0, 0, 0.5), 300.0);
  Joint spring = test::joint_at(JointKind::kSpring, world, 0, {}, Vec3(0, 0, 0.5));
  spring.anchor_b_m = Vec3::Zero();
  spring.length_m = 0.5;
  spring.stiffness_newton_m = 1500.0;
  spring.damping_newton_s_m = 15.0;
  test::add(world, spring);
  Joint slider = test::joint_at(JointKind::kSlider, world, 0, {}, Vec3(0, 0, 0.5));
  slider.limits = JointLimits{-0.4, 0.4};
  test::add(world, slider);
  EXPECT_LT(steps_to_rest(world, Geometry(world.scene), 300), 300);
}

// It has no velocity at first, nor what holds it.
TEST(Sleeping, ARodThatStandsOutFromABallJointFalls) {
  World world = test::under_gravity();
  world.add_body(world.add_shape(Box{Vec3(0.5, 0.05, 0.05)}), Vec3(0.5, 0, 0));
  world.add_body(world.add_shape(Box{Vec3(0.5, 0.05, 0.05)}), Vec3(1.5, 0, 0));
  test::add(world, test::joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  test::add(world, test::joint_at(JointKind::kBall, world, 0, 1, Vec3(1.0, 0, 0)));
  world.run(30);
  EXPECT_FALSE(world.report.islands.front().rests);
  EXPECT_LT(world.states[1].position_m.z(), -0.5);
}

}  // namespace
}  // namespace soda::physics
