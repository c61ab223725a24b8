// Springs on bodies in contact.
#include "physics/integrators/explicit_springs.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::energy_joule;
using test::kGravity;
using test::under_gravity;
using test::World;

constexpr double kHalf_m = 0.2, kApart_m = 0.9;

// Boxes of 1 kg in a row on a floor, each on a spring to the one before it, the first to the world;
// that one is stretched.
World row(int boxes, double friction, double stiffness_newton_m, double stretch_m,
          double damping_newton_s_m = 0.0) {
  World world = under_gravity();
  const Material material{friction, 0.0};
  world.add_floor(material);
  const std::uint32_t box = world.add_shape(Box{Vec3(kHalf_m, kHalf_m, kHalf_m)});
  const double density = 1.0 / std::pow(2.0 * kHalf_m, 3);
  for (int i = 0; i < boxes; ++i)
    world.add_body(box, Vec3(kApart_m * i, 0, kHalf_m), density, material);
  for (int i = 0; i < boxes; ++i) {
    const auto body = static_cast<std::uint32_t>(i);
    const Vec3 end(kApart_m * (i == 0 ? -1 : i), 0, kHalf_m);
    Joint joint = i == 0 ? test::joint_at(JointKind::kSpring, world, body, std::nullopt, end)
                         : test::joint_at(JointKind::kSpring, world, body - 1, body, end);
    joint.anchor_a_m = Vec3::Zero();
    joint.length_m = i == 0 ? kApart_m - stretch_m : kApart_m;
    joint.stiffness_newton_m = stiffness_newton_m;
    joint.damping_newton_s_m = damping_newton_s_m;
    test::add(world, joint);
  }
  return world;
}

TEST(ExplicitSprings, ABoxOnIceSwingsAsItsClosedFormSaysAndGainsNoEnergy) {
  constexpr double kStretch_m = 0.3;
  for (const double stiffness : {1.0, 30.0, 400.0}) {
    World world = row(1, 0.0, stiffness, kStretch_m);
    const Geometry geometry(world.scene);
    const double energy = energy_joule(world), lent = 0.5 * stiffness * kStretch_m * kStretch_m;
    for (int step = 1; step <= 600; ++step) {
      world.run(1, geometry);
      const double phase = std::sqrt(stiffness) * step * world.scene.dt_s;
      ASSERT_NEAR(world.states[0].position_m.x(), kStretch_m * (std::cos(phase) - 1.0), 2e-4)
          << stiffness << " step " << step;
      ASSERT_LE(energy_joule(world), energy + 1e-9 * lent) << stiffness << " step " << step;
    }
    EXPECT_GE(energy_joule(world), energy - 1e-3 * lent) << stiffness;
  }
}

TEST(ExplicitSprings, ARowOfBoxesOnIceKeepsItsEnergy) {
  constexpr double kStiffness = 100.0, kStretch_m = 0.2;
  for (const int boxes : {2, 3, 8}) {
    World world = row(boxes, 0.0, kStiffness, kStretch_m);
    const Geometry geometry(world.scene);
    const double energy = energy_joule(world), lent = 0.5 * kStiffness * kStretch_m * kStretch_m;
    for (int step = 0; step < 300; ++step) {
      world.run(1, geometry);
      ASSERT_LE(energy_joule(world), energy + 1e-9 * lent) << boxes << " step " << step;
    }
    // A step without a limit is implicit.
    EXPECT_GE(energy_joule(world), energy - 1e-3 * lent) << boxes;
  }
}

// A rigid row on a table would lose half of each swing in a second to implicit steps.
TEST(ExplicitSprings, WhatIsTooStiffToBeFollowedIsDamped) {
  World world = row(1, 0.0, 1e6, 0.01);
  const double energy = energy_joule(world);
  const Geometry geometry(world.scene);
  world.run(60, geometry);
  EXPECT_LE(energy_joule(world), energy);
  EXPECT_NEAR(world.states[0].position_m.x(), -0.01, 1e-6);
}

TEST(ExplicitSprings, FrictionTakesAsMuchOfEachSwingAndTheEndIsRest) {
  constexpr double kStiffness = 100.0, kStretch_m = 0.3, kFriction = 0.1;
  constexpr double kReach_m = kFriction * kGravity / kStiffness;
  for (const double dt : {1.0 / 60.0, 1.0 / 100.0, 1.0 / 240.0}) {
    World world = row(1, kFriction, kStiffness, kStretch_m);
    world.scene.dt_s = dt;
    const Geometry geometry(world.scene);
    world.run(static_cast<int>(6.0 / dt), geometry);
    double end = kStretch_m;
    while (std::abs(end) > kReach_m) end = end > 0.0 ? 2 * kReach_m - end : -2 * kReach_m - end;
    EXPECT_NEAR(world.states[0].position_m.x(), end - kStretch_m, 2e-6) << dt;
    EXPECT_EQ(world.states[0].linear_velocity_m_s, Vec3(Vec3::Zero())) << dt;
    const std::uint64_t solved = world.counters.islands_solved;
    const std::vector<BodyState> before = world.states;
    world.run(10, geometry);
    EXPECT_EQ(world.counters.islands_solved, solved) << "it rests";
    EXPECT_TRUE(identical(before[0], world.states[0]));
  }
}

// Statics give what the bodies' momentum lacks: gravity is all else that acts.
TEST(ExplicitSprings, WhatSpringsAndFloorGiveIsReported) {
  World world = row(2, 0.3, 100.0, 0.3, 2.0);
  const Geometry geometry(world.scene);
  for (int step = 0; step < 60; ++step) {
    const Vec3 before = world.states[0].linear_velocity_m_s + world.states[1].linear_velocity_m_s;
    world.run(1, geometry);
    const Vec3 after = world.states[0].linear_velocity_m_s + world.states[1].linear_velocity_m_s;
    Vec3 given = Vec3::Zero();
    for (const IslandReport& island : world.report.islands) given += island.static_impulse_newton_s;
    const Vec3 weight(0, 0, -2.0 * kGravity * world.scene.dt_s);
    ASSERT_LT((after - before - weight - given).norm(), 1e-12) << step;
  }
}

}  // namespace
}  // namespace soda::physics
