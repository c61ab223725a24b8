#include "physics/constraints/springs.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::energy_joule;
using test::World;

Joint& add_spring(World& world, std::uint32_t a, std::optional<std::uint32_t> b, const Vec3& end_a,
                  const Vec3& end_b, double length_m, double stiffness_newton_m) {
  Joint joint = test::joint_at(JointKind::kSpring, world, a, b, end_b);
  joint.anchor_a_m =
      world.states[a].orientation.conjugate() * Vec3(end_a - world.states[a].position_m);
  joint.length_m = length_m;
  joint.stiffness_newton_m = stiffness_newton_m;
  return test::add(world, joint);
}

TEST(Springs, AnOscillationHasItsClosedFormHoweverStiffAndDamped) {
  for (const double rate : {0.01, 1.0, 30.0, 1e3, 3e4})
    for (const double damping : {0.0, 1e-3, 0.3, 0.99, 1.01, 3.0, 100.0}) {
      constexpr double kTime_s = 1.0 / 60.0;
      const double b = damping * rate;
      const Oscillation o = oscillate(rate * rate, b, kTime_s);
      const double split = std::sqrt(std::abs(rate * rate - b * b));
      const double left = std::exp(-b * kTime_s), slow = std::exp((split - b) * kTime_s),
                   fast = std::exp(-(split + b) * kTime_s);
      const double turns =
          damping < 1.0 ? left * std::sin(split * kTime_s) / split : (slow - fast) / (2.0 * split);
      const double mean = damping < 1.0 ? left * std::cos(split * kTime_s) : 0.5 * (slow + fast);
      // The phase is known to its own rounding.
      const double rounding = 1e-15 * (10.0 + 10.0 * rate * kTime_s * (1.0 + damping));
      EXPECT_NEAR(o.turns_s * rate, turns * rate, rounding) << rate << " " << damping;
      EXPECT_NEAR(o.keeps, mean + b * turns, rounding * (1.0 + damping)) << rate << " " << damping;
      EXPECT_NEAR(o.speed, mean - b * turns, rounding * (1.0 + damping)) << rate << " " << damping;
    }
}

TEST(Springs, CriticalDampingIsTheLimitOfBothSides) {
  constexpr double kRate = 40.0, kTime_s = 0.02;
  const Oscillation o = oscillate(kRate * kRate, kRate, kTime_s);
  const double left = std::exp(-kRate * kTime_s);
  EXPECT_NEAR(o.turns_s, kTime_s * left, 1e-16);
  EXPECT_NEAR(o.keeps, (1.0 + kRate * kTime_s) * left, 1e-15);
  for (const double near : {1.0 - 1e-9, 1.0 + 1e-9})
    EXPECT_NEAR(oscillate(kRate * kRate, near * kRate, kTime_s).turns_s, o.turns_s, 1e-10);
}

// Two balls on one line, in free fall and turning about that line: places by hand, at any step.
TEST(Springs, TwoBodiesOnOneLineMoveAsTheirClosedForm) {
  constexpr double kStiffness = 500.0, kLength_m = 2.0, kTime_s = 1.0;
  for (const double dt_s : {1.0 / 240.0, 1.0 / 60.0, 0.1}) {
    World world = test::under_gravity();
    world.scene.dt_s = dt_s;
    const std::uint32_t ball = world.add_shape(Sphere{0.2});
    world.add_body(ball, Vec3(0, 0, 0)).linear_velocity_m_s = Vec3(0.5, 1, 0);
    world.add_body(ball, Vec3(2.3, 0, 0), 3000.0).linear_velocity_m_s = Vec3(0.1, 1, 0);
    world.states[1].angular_velocity_rad_s = Vec3(1, 2, 3);
    add_spring(world, 0, 1, Vec3(0, 0, 0), Vec3(2.3, 0, 0), kLength_m, kStiffness);
    const double a = world.scene.bodies[0].mass_kg, b = world.scene.bodies[1].mass_kg;
    const double rate = std::sqrt(kStiffness * (1.0 / a + 1.0 / b));
    world.run(static_cast<int>(std::lround(kTime_s / dt_s)));
    const double apart =
        kLength_m + 0.3 * std::cos(rate * kTime_s) - 0.4 / rate * std::sin(rate * kTime_s);
    const double centre = (b * 2.3 + (0.5 * a + 0.1 * b) * kTime_s) / (a + b);
    const double fallen = -0.5 * test::kGravity * kTime_s * kTime_s;
    const Vec3 exact_a(centre - apart * b / (a + b), kTime_s, fallen);
    const Vec3 exact_b(centre + apart * a / (a + b), kTime_s, fallen);
    EXPECT_LT((world.states[0].position_m - exact_a).norm(), 1e-12) << dt_s;
    EXPECT_LT((world.states[1].position_m - exact_b).norm(), 1e-12) << dt_s;
  }
}

TEST(Springs, AClosedFormNeedsNoTrialsAndHasNoErrorToEstimate) {
  World world = test::under_gravity();
  world.scene.tolerance = 1e-6;
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, -0.6));
  add_spring(world, 0, std::nullopt, Vec3(0, 0, -0.6), Vec3(0, 0, 0), 0.5, 1e9);
  world.run(10);
  EXPECT_EQ(world.counters.refined_steps, 0u);
  ASSERT_EQ(world.report.islands.size(), 1u);
  EXPECT_EQ(world.report.islands[0].error_estimate, 0.0);
  EXPECT_FALSE(world.report.islands[0].beyond_tolerance);
}

// Two boxes held at their corners by two springs, that turn, stretch and fly.
World tumbling_pair(double dt_s, double stiffness_newton_m) {
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.3, 0.2, 0.1)});
  world.add_body(box, Vec3(0, 0, 0), 500.0).linear_velocity_m_s = Vec3(0, 2, 0);
  world.add_body(box, Vec3(1.5, 0, 0), 1000.0).angular_velocity_rad_s = Vec3(0.3, 1, 0.2);
  add_spring(world, 0, 1, Vec3(0.3, 0.2, 0.1), Vec3(1.2, 0.2, -0.1), 0.7, stiffness_newton_m);
  add_spring(world, 0, 1, Vec3(0.3, -0.2, 0.1), Vec3(1.2, -0.2, 0.1), 0.8,
             1.5 * stiffness_newton_m);
  return world;
}

World tumbled(double dt_s) {
  World world = tumbling_pair(dt_s, 10.0);  // in one part a step
  world.run(static_cast<int>(std::lround(0.5 / dt_s)));
  return world;
}

TEST(Springs, AreOfFourthOrderWhereTheyTurn) {
  const World exact = tumbled(1.0 / 3840.0);
  std::vector<double> errors;
  for (const double dt_s : {1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0})
    errors.push_back((tumbled(dt_s).states[0].position_m - exact.states[0].position_m).norm());
  EXPECT_LT(errors[0], 1e-5);
  for (std::size_t i = 1; i < errors.size(); ++i)
    EXPECT_GE(std::log2(errors[i - 1] / errors[i]), 3.7) << errors[i - 1] << " " << errors[i];
}

TEST(Springs, KeepEnergyAndMomentumWhereTheyTurn) {
  World world = tumbling_pair(1.0 / 60.0, 800.0);
  world.scene.gravity_m_s2 = Vec3::Zero();
  const double before = energy_joule(world);
  const Mechanics start = world.mechanics();
  for (int i = 0; i < 600; ++i) {
    world.run(1);
    ASSERT_NEAR(energy_joule(world), before, 1e-6 * before) << i;
  }
  const Mechanics end = world.mechanics();
  EXPECT_LT((end.linear_momentum_newton_s - start.linear_momentum_newton_s).norm(),
            1e-12 * start.linear_momentum_newton_s.norm());
  EXPECT_LT((end.angular_momentum_newton_m_s - start.angular_momentum_newton_m_s).norm(),
            1e-11 * start.angular_momentum_newton_m_s.norm());
}

// Swings across its line, so there is no closed form; and is too fast to be followed.
TEST(Springs, AStiffSpringThatTurnsGainsNoEnergy) {
  for (const double stiffness : {1e5, 1e7, 1e9}) {
    World world = test::under_gravity();
    world.add_body(world.add_shape(Sphere{0.1}), Vec3(0.3, 0, -0.4), 1000.0).linear_velocity_m_s =
        Vec3(0, 0.6, 0);
    add_spring(world, 0, std::nullopt, Vec3(0.3, 0, -0.4), Vec3(0, 0, 0), 0.499, stiffness);
    double before = energy_joule(world);
    const double start = before, motion = start + world.scene.bodies[0].mass_kg * 9.81;
    for (int i = 0; i < 600; ++i) {
      world.run(1);
      ASSERT_LE(energy_joule(world), start + 1e-9 * motion) << stiffness << " at " << i;
    }
    EXPECT_NEAR(world.states[0].position_m.norm(), 0.5, 0.01) << stiffness;
  }
}

// Hundreds of turns in a step about an end, or a pull that is over long before it: too much for an
// implicit step, which goes straight on.
TEST(Springs, WhatIsTooFastForItsStepGainsNoEnergy) {
  for (const double length : {1e-3, 0.1, 1.0})
    for (const double stiffness : {1e5, 1e9}) {
      World world;
      world.scene.dt_s = 1.0 / 60.0;
      world.add_body(world.add_shape(Sphere{0.1}), Vec3(length, 0, 0)).linear_velocity_m_s =
          Vec3(3, 80, -20);
      add_spring(world, 0, std::nullopt, Vec3(length, 0, 0.05), Vec3::Zero(), length, stiffness);
      const Geometry geometry(world.scene);
      const double energy = energy_joule(world);
      for (int step = 0; step < 20; ++step) {
        world.run(1, geometry);
        ASSERT_LE(energy_joule(world), energy * (1.0 + 1e-9)) << length << " " << stiffness;
      }
    }
}

}  // namespace
}  // namespace soda::physics
