// Islands whose joints are swept instead of factorised.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics/constraints/joint_islands.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/solvers/solve_choice.hpp"
#include "tests/physics/joints.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::hanging_grid;
using test::joint_at;
using test::kSpacing_m;
using test::largest_gap_m;
using test::World;

double joule(const World& world) {
  return world.mechanics().kinetic_energy_joule + world.mechanics().potential_energy_joule;
}

TEST(SweptJoints, OfAGridTakeTheSameWorkForEachRowHoweverLargeItIs) {
  for (const std::uint32_t n : {28u, 32u, 40u}) {
    World world = hanging_grid(n);
    world.run(3);
    const std::uint64_t rows = 3 * world.scene.joints.size();
    EXPECT_EQ(world.counters.joint_sweeps, 3 * 24 * rows) << n;
    EXPECT_EQ(world.counters.factor_multiplications, 0u) << n;
    EXPECT_EQ(world.counters.islands_over_budget, 3u) << n;
  }
}

TEST(SweptJoints, TellHowFarTheyAreOpenAndGainNoEnergy) {
  World world = hanging_grid(28);
  for (int step = 0; step < 60; ++step) {
    const double before = joule(world);
    world.run(1);
    ASSERT_EQ(world.report.islands.size(), 1u);
    const IslandReport& island = world.report.islands.front();
    EXPECT_LE(joule(world) - before, island.push_out_work_joule + 1e-9 * std::abs(before)) << step;
    const double gap_m = largest_gap_m(world);
    EXPECT_LE(island.joint_error, gap_m * (1.0 + 1e-9)) << step;
    EXPECT_GE(island.joint_error, gap_m / std::sqrt(3.0) * (1.0 - 1e-9)) << step;
    EXPECT_LT(gap_m, 0.05 * kSpacing_m) << step;
  }
  EXPECT_GT(world.counters.joint_sweeps, 0u);
}

// Each of the upper joints bears the column below it.
TEST(SweptJoints, BreakUnderMoreThanTheyBear) {
  constexpr std::uint32_t n = 28;
  for (const double share : {0.5, 4.0}) {
    World world = hanging_grid(n);
    const double column_newton = n * world.scene.bodies[0].mass_kg * test::kGravity;
    for (Joint& joint : world.scene.joints)
      if (is_static(joint.b)) joint.most_force_newton = share * column_newton;
    order_joints(world.scene);
    world.run(60);
    EXPECT_GT(world.counters.joint_sweeps, 0u);
    EXPECT_EQ(world.counters.joints_broken, share < 1.0 ? n : 0u);
  }
}

// Doors of hinges with stops and motors, some of them in pairs on a common post, and bouncing
// balls.
TEST(SweptJoints, AccountForTheWorldsImpulsesOfLimitsMotorsAndRebounds) {
  World world = test::under_gravity();
  world.scene.solver.refined = false;
  world.add_floor(Material{.restitution = 0.5});
  const std::uint32_t ball = world.add_shape(Sphere{0.2}),
                      bar = world.add_shape(Box{{0.4, 0.1, 0.1}});
  for (std::uint32_t i = 0; i < 40; ++i) {
    const Vec3 at(0.85 * (i % 4), 0.23 * (i / 4), 0.4 + 0.01 * i);
    world.add_body(i % 3 == 2 ? ball : bar, at, 500.0 + 40.0 * i, Material{.restitution = 0.5});
    Joint& joint = add(world, joint_at(JointKind::kHinge, world, i, std::nullopt,
                                       at - Vec3(0.3, 0, 0), Vec3::UnitY()));
    joint.limits = JointLimits{-0.3, 0.3};
    if (i % 2 == 0) joint.motor = JointMotor{2.0, 40.0};
  }
  for (int i = 0; i < 12; ++i)
    world.add_body(ball, Vec3(0.25 * i, 0.2 * i, 1.6), 1000.0, Material{.restitution = 0.5})
        .linear_velocity_m_s = Vec3(0, 0, -5);
  double largest = 0.0;
  for (int step = 0; step < 90; ++step) {
    const IslandMomentum before = momentum_of(world.scene, world.ids, world.states);
    world.run(1);
    Vec3 given = world.scene.gravity_m_s2 * (before.mass_kg * world.scene.dt_s);
    for (const IslandReport& island : world.report.islands) given += island.static_impulse_newton_s;
    const IslandMomentum after = momentum_of(world.scene, world.ids, world.states);
    largest = std::max(largest, given.norm());
    EXPECT_LE((after.linear_newton_s - before.linear_newton_s - given).norm(), 1e-11 * largest)
        << step;
  }
  EXPECT_GT(world.counters.joint_sweeps, 0u);
  EXPECT_GT(world.counters.restitution_rows, 0u);
}

// A chain of trunks that crawls on legs, whose motors drive them against stops. Motors and stops
// that were swept beside joints that were solved let a leg pass its stop by another hundredth of a
// radian in each step.
TEST(SweptJoints, KeepStopsAgainstWhichMotorsDrive) {
  World world = test::under_gravity();
  world.scene.solver.refined = false;  // quality fast
  world.add_floor();
  const std::uint32_t trunk = world.add_shape(Box{Vec3(0.12, 0.1, 0.05)}),
                      leg = world.add_shape(Capsule{0.03, 0.17});
  constexpr std::uint32_t kTrunks = 30;
  for (std::uint32_t k = 0; k < kTrunks; ++k) {
    const double x = 0.3 * k;
    world.add_body(trunk, Vec3(x, 0, 0.6), 200.0);
    if (k > 0)
      add(world, joint_at(JointKind::kBall, world, 3 * k - 3, 3 * k, Vec3(x - 0.15, 0, 0.6)));
    for (const double side : {0.16, -0.16}) {
      const auto number = static_cast<std::uint32_t>(world.ids.size());
      world.add_body(leg, Vec3(x, side, 0.35), 100.0);
      Joint& hip = add(world, joint_at(JointKind::kHinge, world, 3 * k, number, Vec3(x, side, 0.55),
                                       Vec3::UnitY()));
      hip.limits = JointLimits{-0.6, 0.6};
      hip.motor = JointMotor{(k + number) % 2 == 0 ? 3.0 : -3.0, 3.0};
    }
  }
  double off = 0.0;
  for (int step = 0; step < 90; ++step) {
    world.run(1);
    for (const IslandReport& island : world.report.islands) off = std::max(off, island.joint_error);
  }
  EXPECT_GT(world.counters.joint_sweeps, 0u);
  EXPECT_LT(off, 1e-3);
}

TEST(SweptJoints, AreForWhatTakesMuchWorkWithoutAToleranceOfNearlyEqualMasses) {
  const auto swept = [](const World& world) {
    const std::vector<JointIsland> islands = joint_islands(world.scene);
    EXPECT_EQ(islands.size(), 1u);
    return are_joints_swept(world.scene, islands.front());
  };
  EXPECT_FALSE(swept(hanging_grid(8)));
  EXPECT_TRUE(swept(hanging_grid(28)));
  EXPECT_FALSE(swept(hanging_grid(28, 1e5)));
  World fast = hanging_grid(12), accurate = hanging_grid(28);
  fast.scene.solver.refined = false;
  accurate.scene.tolerance = 1e-6;
  EXPECT_TRUE(swept(fast));
  EXPECT_FALSE(swept(accurate));
}

// Boxes in one plane that fixed joints hold, n by n, and a ball that comes down on them later.
World glued_plate_under_a_ball(std::uint32_t n) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{Vec3(0.1, 0.1, 0.05)});
  const auto place = [](double x, double y) { return Vec3(0.2 * x, 0.2 * y, 0.1); };
  for (std::uint32_t i = 0; i < n * n; ++i) world.add_body(box, place(i % n, i / n));
  for (std::uint32_t i = 0; i < n * n; ++i) {
    const double x = i % n, y = i / n;
    if (i % n > 0) add(world, joint_at(JointKind::kFixed, world, i - 1, i, place(x - 0.5, y)));
    if (i >= n) add(world, joint_at(JointKind::kFixed, world, i - n, i, place(x, y - 0.5)));
  }
  world.add_body(world.add_shape(Sphere{0.2}), Vec3(0.3, 0.35, 150.0));
  return world;
}

// Solved in eight substeps, heavy things sink into light ones by what these give way.
TEST(SweptJoints, HoldWhatIsManyTimesAsHeavy) {
  for (const double times : {10.0, 100.0, 1000.0}) {
    World world = test::under_gravity();
    world.scene.solver.refined = false;
    world.add_floor(Material{.friction = 0.5});
    constexpr std::uint32_t n = 8;
    static constexpr double kRadius_m = 0.1;
    const std::uint32_t ball = world.add_shape(Sphere{kRadius_m});
    const auto place = [](double x, double y) { return Vec3(0.2 * x, 0.2 * y, kRadius_m); };
    for (std::uint32_t i = 0; i < n * n; ++i) world.add_body(ball, place(i % n, i / n), 1000.0);
    for (std::uint32_t i = 0; i < n * n; ++i) {
      const double x = i % n, y = i / n;
      if (i % n > 0) add(world, joint_at(JointKind::kBall, world, i - 1, i, place(x - 0.5, y)));
      if (i >= n) add(world, joint_at(JointKind::kBall, world, i - n, i, place(x, y - 0.5)));
    }
    const double volume_m3 = 8.0 * 0.15 * 0.15 * 0.15;
    const double ball_kg = world.scene.bodies[0].mass_kg;
    world.add_body(world.add_shape(Box{Vec3(0.15, 0.15, 0.15)}),
                   Vec3(0.7, 0.7, 2.0 * kRadius_m + 0.15), times * ball_kg / volume_m3);
    double deepest_m = 0.0;
    for (int step = 0; step < 60; ++step) {
      world.run(1);
      for (const IslandReport& island : world.report.islands)
        deepest_m = std::max(deepest_m, island.max_penetration_m);
    }
    EXPECT_GT(world.counters.joint_sweeps, 0u);
    EXPECT_LT(deepest_m, 0.03 * kRadius_m) << times;
  }
}

// A ball that joints hold at a third of the speed that bodies may have: substeps diverge, and more
// of them start from where these did, which without contacts is the bodies alone.
TEST(SweptJoints, DivergeWithoutContactsAndGainNoEnergy) {
  World world = hanging_grid(12);
  world.scene.solver.refined = false;
  world.states[70].linear_velocity_m_s = Vec3(0, 3e8, 0);
  const double before = joule(world);
  world.run(1);
  EXPECT_TRUE(world.report.faults.empty());
  EXPECT_LE(joule(world), before);
}

TEST(SweptJoints, ComeToRestAndTakeNoIterationsUntilTheyAreHit) {
  for (const std::uint32_t n : {8u, 12u}) {
    World world = glued_plate_under_a_ball(n);
    world.scene.solver.refined = false;  // quality fast: iterations from the start
    world.run(300);
    const std::uint64_t swept = world.counters.joint_sweeps;
    EXPECT_GT(swept, 0u) << n;
    const std::vector<BodyState> rested = world.states;
    world.run(20);
    EXPECT_EQ(world.counters.joint_sweeps, swept) << n;
    for (std::uint32_t i = 0; i < n * n; ++i)
      EXPECT_EQ(world.states[i].position_m, rested[i].position_m) << n << ", body " << i;
    world.run(20);
    EXPECT_GT(world.counters.joint_sweeps, swept) << n;
  }
}

}  // namespace
}  // namespace soda::physics
