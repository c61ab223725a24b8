// Impacts of what joints hold: balls on strings.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr double kRadius_m = 0.1, kString_m = 1.0, kAside_m = 0.6;
constexpr double kRaised_rad = 0.6;

// Balls in a row that touch, or nearly, each on two strings; the first ones are drawn aside
// together.
World cradle(int balls, int raised, double dt_s, double gap_m = 0.0) {
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  const Material elastic{.friction = 0.0, .restitution = 1.0};
  const std::uint32_t ball = world.add_shape(Sphere{kRadius_m});
  for (int i = 0; i < balls; ++i) {
    const double angle = i < raised ? kRaised_rad : 0.0;
    const double place_m = (2.0 * kRadius_m + gap_m) * i;
    const Vec3 at(place_m - kString_m * std::sin(angle), 0.0, kString_m * (1.0 - std::cos(angle)));
    world.add_body(ball, at, 1000.0, elastic);
    for (const double side : {-kAside_m, kAside_m}) {
      Joint joint = test::joint_at(JointKind::kDistance, world, static_cast<std::uint32_t>(i),
                                   std::nullopt, at);
      joint.anchor_b_m = Vec3(place_m, side, kString_m);
      joint.length_m = (joint.anchor_b_m - at).norm();
      test::add(world, joint);
    }
  }
  return world;
}

double fastest_m_s() {
  return std::sqrt(2.0 * test::kGravity * kString_m * (1.0 - std::cos(kRaised_rad)));
}

// Until the first ones have come down, and a bit more.
void swing_through(World& world) {
  const double quarter_s = 0.5 * M_PI * std::sqrt(kString_m / test::kGravity);
  world.run(static_cast<int>(std::ceil(1.15 * quarter_s / world.scene.dt_s)));
}

TEST(LinkedImpacts, ARowOfBallsOnStringsHandsItsSpeedOn) {
  for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240})
    for (const int balls : {2, 3, 5, 8, 9, 16, 33}) {
      World world = cradle(balls, 1, dt);
      swing_through(world);
      for (int i = 0; i + 1 < balls; ++i)
        EXPECT_LT(world.states[i].linear_velocity_m_s.norm(), 0.02 * fastest_m_s())
            << "ball " << i << " of " << balls << ", " << dt;
      EXPECT_GT(world.states[balls - 1].linear_velocity_m_s.x(), 0.9 * fastest_m_s())
          << balls << " balls, " << dt;
    }
}

TEST(LinkedImpacts, AsManyFlyOffAsHaveCome) {
  for (const int raised : {2, 3}) {
    World world = cradle(7, raised, 1.0 / 60);
    swing_through(world);
    for (int i = 0; i < 7; ++i) {
      const double speed = world.states[i].linear_velocity_m_s.x() / fastest_m_s();
      if (i < 7 - raised)
        EXPECT_LT(std::abs(speed), 0.03) << "ball " << i << ", " << raised << " raised";
      else
        EXPECT_GT(speed, 0.9) << "ball " << i << ", " << raised << " raised";
    }
  }
}

// Each flies to the next within the step, and is found there.
TEST(LinkedImpacts, ARowWithGapsLosesNothing) {
  for (const double gap_m : {1e-4, 1e-3, 0.01, 0.05})
    for (const int balls : {2, 3, 5}) {
      World world = cradle(balls, 1, 1.0 / 60, gap_m);
      const Mechanics start = world.mechanics();
      double deepest_m = 0.0;
      const Geometry geometry(world.scene);
      for (int step = 0; step < 300; ++step) {
        world.run(1, geometry);
        for (const IslandReport& island : world.report.islands)
          deepest_m = std::max(deepest_m, island.max_penetration_m);
      }
      const Mechanics end = world.mechanics();
      const double had = world.scene.bodies[0].mass_kg * 0.5 * fastest_m_s() * fastest_m_s();
      const double lost = start.kinetic_energy_joule + start.potential_energy_joule -
                          end.kinetic_energy_joule - end.potential_energy_joule;
      EXPECT_LT(std::abs(lost), 0.01 * had) << balls << " balls, gaps of " << gap_m;
      EXPECT_LT(deepest_m, 1e-3 * kRadius_m) << balls << " balls, gaps of " << gap_m;
    }
}

// What is below the restitution threshold does not bounce, and so is lost.
TEST(LinkedImpacts, ACradleKeepsItsEnergyForTenSeconds) {
  for (const int balls : {2, 3, 5, 7}) {
    World world = cradle(balls, 1, 1.0 / 60);
    const Mechanics start = world.mechanics();
    world.run(600);
    const Mechanics end = world.mechanics();
    const double lost = start.kinetic_energy_joule + start.potential_energy_joule -
                        end.kinetic_energy_joule - end.potential_energy_joule;
    const double had = world.scene.bodies[0].mass_kg * 0.5 * fastest_m_s() * fastest_m_s();
    EXPECT_LT(lost, 0.03 * had) << balls;
    EXPECT_GT(lost, -1e-9 * had) << balls;
  }
}

}  // namespace
}  // namespace soda::physics
