// What hangs and swings from bodies that are touched: external forces in two halves.
#include <gtest/gtest.h>

#include <cmath>

#include "physics/measures/measures.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::energy_joule;
using test::under_gravity;
using test::World;

constexpr Material kRough{.friction = 1.0, .restitution = 0.0};

// On a hinge at the top of the first body, let go at this angle. Returns the hinge's place.
std::size_t add_rod(World& world, double rod_kg, double angle_rad, double aside_m) {
  const Vec3 rod(0.05, 0.05, 0.5), anchor(0, aside_m, 2.6);
  const Vec3 way(std::sin(angle_rad), 0, -std::cos(angle_rad));
  const auto body = static_cast<std::uint32_t>(world.states.size());
  world
      .add_body(world.add_shape(Box{rod}), anchor + rod.z() * way,
                rod_kg / (8.0 * rod.x() * rod.y() * rod.z()), kRough)
      .orientation = turn_between(-Vec3::UnitZ(), way);
  test::add(world, test::joint_at(JointKind::kHinge, world, 0, body, anchor, Vec3::UnitY()));
  return world.scene.joints.size() - 1;
}

// A block of 500 kg that stands on a floor, with a rod.
World rod_on_a_stand(double rod_kg, double angle_rad, double dt_s) {
  World world = under_gravity();
  world.scene.dt_s = dt_s;
  world.add_floor(kRough);
  const Vec3 half(0.5, 1.0, 1.0);
  world.add_body(world.add_shape(Box{half}), Vec3(0, 0, 1.0),
                 500.0 / (8.0 * half.x() * half.y() * half.z()), kRough);
  add_rod(world, rod_kg, angle_rad, 0.0);
  return world;
}

// Of the energy of swinging, after this time.
double kept(World world, double duration_s) {
  const double start = energy_joule(world);
  World lowest = world;
  lowest.states[1].position_m = Vec3(0, 0, 2.1);
  const double scale = start - energy_joule(lowest);
  world.run(static_cast<int>(std::lround(duration_s / world.scene.dt_s)));
  return 1.0 - (start - energy_joule(world)) / scale;
}

TEST(JointKicks, ARodOnAStandSwingsOn) {
  constexpr double kDuration_s = 10.0;
  for (const double rod_kg : {0.1, 1.0, 10.0})
    for (const double angle_rad : {0.1, 0.5, 1.0}) {
      EXPECT_GE(kept(rod_on_a_stand(rod_kg, angle_rad, 1.0 / 60.0), kDuration_s), 0.93) << rod_kg;
      EXPECT_GE(kept(rod_on_a_stand(rod_kg, angle_rad, 1.0 / 240.0), kDuration_s), 0.99) << rod_kg;
    }
}

TEST(JointKicks, GainNoEnergyAndMoveNoStand) {
  World world = rod_on_a_stand(10.0, 1.0, 1.0 / 60.0);
  const double start = energy_joule(world);
  const Vec3 stand = world.states[0].position_m;
  const Geometry geometry(world.scene);
  for (int i = 0; i < 600; ++i) {
    world.run(1, geometry);
    ASSERT_LE(energy_joule(world), start * (1.0 + 1e-12)) << i;
    ASSERT_LE((world.states[0].position_m - stand).norm(), 1e-5) << i;
  }
}

// Beside one that swings: an island that stands still is not looked at.
TEST(JointKicks, WhatAMotorHoldsUpStays) {
  World world = rod_on_a_stand(10.0, 1.0, 1.0 / 60.0);
  const std::size_t hinge = add_rod(world, 10.0, 1.2, 1.5);
  world.scene.joints[hinge].motor = JointMotor{.speed = 0.0, .most_push = 1e4};
  const Vec3 start = world.states[2].position_m;
  world.run(600);
  EXPECT_GT(world.mechanics().kinetic_energy_joule, 0.1);
  EXPECT_LE((world.states[2].position_m - start).norm(), 1e-3);
}

}  // namespace
}  // namespace soda::physics
