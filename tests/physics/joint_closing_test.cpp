// Joints that a step has opened, between bodies of any masses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/physics/joints.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr double kLink_m = 0.4, kRod_m = 0.06;

// Every other link is `ratio` times as heavy as the one before. Rods (distance joints) hold them to
// each other, and the first to the world; the last comes down on the floor.
World rope_of_rods(int links, double ratio, int rate) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / rate;
  world.add_floor();
  const Vec3 half(0.17, 0.1, 0.04);
  const std::uint32_t link = world.add_shape(Box{half});
  const double height_m = 0.5 * links * kLink_m + 0.1;
  for (int i = 0; i < links; ++i)
    world.add_body(link, Vec3((i + 0.5) * kLink_m, 0, height_m),
                   (i % 2 == 1 ? 1.0 : ratio) / (8.0 * half.prod()));
  for (int i = 0; i < links; ++i) {
    const Vec3 before(i * kLink_m - 0.5 * kRod_m, 0, height_m);
    const Vec3 after = before + Vec3(kRod_m, 0, 0);
    Joint rod =
        test::joint_at(JointKind::kDistance, world, static_cast<std::uint32_t>(i), {}, after);
    rod.anchor_b_m = before;
    if (i > 0) {
      rod.a = BodyId{static_cast<std::uint32_t>(i - 1)};
      rod.b = BodyId{static_cast<std::uint32_t>(i)};
      rod.anchor_a_m = before - world.states[i - 1].position_m;
      rod.anchor_b_m = after - world.states[i].position_m;
    }
    rod.length_m = kRod_m;
    rod.reach_m = kRod_m + 8.0 * half.norm();
    test::add(world, rod);
  }
  return world;
}

double joule(const World& world) {
  return world.mechanics().kinetic_energy_joule + world.mechanics().potential_energy_joule;
}

TEST(JointClosing, ARopeOfRodsBetweenLightAndHeavyStaysClosedAndGainsNothing) {
  for (const int links : {2, 5, 10, 20})
    for (const double ratio : {1.0, 1e2, 1e4, 1e6})
      for (const int rate : {30, 60, 240}) {
        World world = rope_of_rods(links, ratio, rate);
        double gap_m = 0.0;
        for (int step = 0; step < rate; ++step) {
          const double before = joule(world);
          world.run(1);
          ASSERT_TRUE(world.report.faults.empty()) << links << ", " << ratio << ", " << rate;
          double given = 0.0;
          for (const IslandReport& island : world.report.islands)
            given += island.push_out_work_joule;
          EXPECT_LE(joule(world) - before - given, 1e-9 * (std::abs(before) + std::abs(given)))
              << links << ", " << ratio << ", " << rate << ", step " << step;
          gap_m = std::max(gap_m, test::largest_misfit_m(world));
        }
        EXPECT_LT(gap_m, 1e-9) << links << ", " << ratio << ", " << rate;
      }
}

// Between bodies of millimetres, steps of .1 s lead joints apart by many widths; closing them at
// once lifted the bodies by more than they had fallen.
TEST(JointClosing, LiftsByNoMoreThanFallsInAStep) {
  World world = test::under_gravity();
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, -1.5), 1.0 / (4.0 / 3.0 * M_PI * 1e-3));
  Joint rod = test::joint_at(JointKind::kDistance, world, 0, {}, Vec3(0, 0, -1.5));
  rod.anchor_b_m = Vec3::Zero();
  rod.length_m = 0.5;
  test::add(world, rod);
  const double fall_m_s = test::kGravity * world.scene.dt_s;
  double misfit_m = test::largest_misfit_m(world);
  for (int step = 0; step < 60; ++step) {
    const double before = joule(world);
    world.run(1);
    EXPECT_LE(joule(world) - before, 1.01 * fall_m_s * fall_m_s) << step;
    EXPECT_LT(test::largest_misfit_m(world), misfit_m) << step;
    misfit_m = test::largest_misfit_m(world);
  }
}

}  // namespace
}  // namespace soda::physics
