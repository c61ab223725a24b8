// Islands that fall, slide or are large: projected Gauss-Seidel in substeps.
#include "physics/solvers/substeps.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

// Boxes on each other, each a little beside the one below.
World stack(int boxes, double offset_m) {
  World world = test::under_gravity();
  world.scene.solver.direct = false;
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < boxes; ++i) world.add_body(box, Vec3(i % 2 ? offset_m : 0, 0, 0.5 + i));
  return world;
}

TEST(Substeps, AStackComesToRestAndSinksByWhatItsSpringsGive) {
  constexpr int kBoxes = 10;
  World world = stack(kBoxes, 0.02);
  world.run(600);
  ASSERT_EQ(world.counters.direct_islands, 0u);
  EXPECT_LT(world.mechanics().kinetic_energy_joule, 1e-3) << "of ten tons";
  for (int i = 0; i < kBoxes; ++i) {
    const Vec3& at = world.states[static_cast<std::size_t>(i)].position_m;
    EXPECT_NEAR(at.x(), i % 2 ? 0.02 : 0.0, 5e-4);
  }
  // At rest a pressing iteration neither adds to an impulse nor takes from it: with r, m and j the
  // shares of overlap, mass and impulse of a spring, m r depth / h = j times the load a mass.
  const double phase = std::numbers::pi / 4, firm = phase * (20 + phase), h = world.scene.dt_s / 8;
  const double r = phase / (20 + phase), m = firm / (1 + firm), j = 1 / (1 + firm);
  const double depth_m = j / (m * r) * kBoxes * test::kGravity * h * h;
  EXPECT_NEAR(0.5 - world.states[0].position_m.z(), 5e-4 + depth_m, 0.05 * depth_m);
}

TEST(Substeps, CollisionsKeepMomentum) {
  World world;
  world.scene.solver.direct = false;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.5, 0.4, 0.3)});
  std::mt19937_64 random(4);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
  for (int i = 0; i < 27; ++i) {
    BodyState& s = world.add_body(box, Vec3(i % 3, i / 3 % 3, i / 9) * 1.3);
    s.linear_velocity_m_s = -2.0 * (s.position_m - Vec3(1.3, 1.3, 1.3));
    s.angular_velocity_rad_s = Vec3(unit(), unit(), unit());
  }
  const Mechanics start = world.mechanics();
  world.run(60);
  const Mechanics end = world.mechanics();
  EXPECT_LT(end.kinetic_energy_joule, 0.9 * start.kinetic_energy_joule) << "they collided";
  EXPECT_LT((end.linear_momentum_newton_s - start.linear_momentum_newton_s).norm(),
            1e-13 * start.momentum_scale_newton_s);
}

// Three boxes in free fall beside each other, so near that they are one island.
TEST(Substeps, WhatDoesNotTouchFliesOnItsParabola) {
  World world = test::under_gravity();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 3; ++i)
    world.add_body(box, Vec3(1.005 * i, 0, 0)).linear_velocity_m_s = Vec3(0.1, 0, 3);
  world.run(30);
  ASSERT_GT(world.counters.islands_solved, 0u);
  for (int i = 0; i < 3; ++i) {
    const double t = 30 * world.scene.dt_s;
    const Vec3 expected = Vec3(1.005 * i + 0.1 * t, 0, 3 * t - 0.5 * 9.81 * t * t);
    EXPECT_LT((world.states[static_cast<std::size_t>(i)].position_m - expected).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace soda::physics
