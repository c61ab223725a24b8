// Drums with paddles on a motor, with cubes in them: many contacts that turn with what they are on,
// beside one joint.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics/math/rigid_motion.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr double kSize_m = 0.14, kPi = 3.14159265358979;

// Twelve staves, and a paddle on each third.
std::uint32_t add_drum(World& world) {
  const std::uint32_t stave = world.add_shape(Box{Vec3(0.03, 0.4, 0.28)}),
                      paddle = world.add_shape(Box{Vec3(0.125, 0.4, 0.02)});
  Compound drum;
  for (int k = 0; k < 12; ++k) {
    const double angle = kPi * k / 6;
    const Vec3 outwards(std::cos(angle), 0, std::sin(angle));
    const Quat turn = test::about(Vec3::UnitY(), -angle);
    drum.parts.push_back({stave, outwards, turn});
    if (k % 3 == 0) drum.parts.push_back({paddle, 0.87 * outwards, turn});
  }
  return world.add_shape(drum);
}

World drum_with(int cubes, double speed_rad_s, double restitution) {
  World world = test::under_gravity();
  const Material wood{.friction = 0.5}, lining{.friction = 0.6, .restitution = restitution};
  const Vec3 hub(0, 0, 1.4);
  world.add_body(add_drum(world), hub, 40.0, lining);
  Joint axle = test::joint_at(JointKind::kHinge, world, 0, std::nullopt, hub, Vec3::UnitY());
  axle.motor = JointMotor{.speed = speed_rad_s, .most_push = 900.0};
  test::add(world, axle);
  const std::uint32_t cube = world.add_shape(Box{Vec3::Constant(0.5 * kSize_m)});
  for (int k = 0; k < cubes; ++k)
    world.add_body(cube,
                   Vec3(-0.4 + 0.2 * (k % 5), -0.25 + 0.25 * (k / 5 % 3), 0.9 + 0.17 * (k / 15)),
                   350.0, wood);
  const std::uint32_t side = world.add_shape(Box{Vec3(1.5, 0.05, 1.5)});
  for (const double y : {-0.46, 0.46})
    world.add_static(side, Vec3(0, y, 1.4), Quat::Identity(), {.friction = 0.02});
  return world;
}

// Of their size. However many there are, and however fast the drum turns.
TEST(TumblingDrums, CubesSinkIntoNothing) {
  for (const int cubes : {8, 24, 40})
    for (const double speed_rad_s : {1.5, 4.0})
      for (const double restitution : {0.0, 0.7}) {
        World world = drum_with(cubes, speed_rad_s, restitution);
        const Geometry geometry(world.scene);
        double deepest_m = 0.0, sum_m = 0.0;
        constexpr int kSteps = 120;
        for (int step = 0; step < kSteps; ++step) {
          world.run(1, geometry);
          double now_m = 0.0;
          for (const IslandReport& island : world.report.islands)
            now_m = std::max(now_m, island.max_penetration_m);
          deepest_m = std::max(deepest_m, now_m);
          sum_m += now_m;
        }
        EXPECT_LT(deepest_m, 0.1 * kSize_m) << cubes << " " << speed_rad_s << " " << restitution;
        EXPECT_LT(sum_m, 0.02 * kSize_m * kSteps)
            << cubes << " " << speed_rad_s << " " << restitution;
      }
}

// A step that is cut into parts has time for all of them: the drum turns as its motor does.
TEST(TumblingDrums, TimeDoesNotStandStill) {
  for (const int cubes : {8, 24, 40}) {
    World world = drum_with(cubes, 1.5, 0.7);
    const Geometry geometry(world.scene);
    double turned_rad = 0.0;
    constexpr int kSteps = 120;
    for (int step = 0; step < kSteps; ++step) {
      const Quat before = world.states[0].orientation;
      world.run(1, geometry);
      turned_rad += small_rotation(before, world.states[0].orientation).norm();
    }
    EXPECT_NEAR(turned_rad, 1.5 / 60.0 * kSteps, 0.02 * 1.5 / 60.0 * kSteps) << cubes;
  }
}

// Halves of halves would take as many iterations each as the whole step.
TEST(TumblingDrums, PartsOfAStepAreItsSubsteps) {
  World world = drum_with(24, 4.0, 0.0);
  world.run(120);
  EXPECT_GT(world.counters.joint_sweeps, 0u);
  EXPECT_LT(world.counters.row_sweeps, 6'000'000u);
}

}  // namespace
}  // namespace soda::physics
