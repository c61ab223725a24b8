// What turns on joints beside contacts: it loses nothing by the length of a step.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "physics/measures/measures.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr Material kIce{.friction = 0.0, .restitution = 0.0};
constexpr double kBall_m = 0.1, kArm_m = 1.0;

World on_ice(double dt_s) {
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  world.add_floor(kIce);
  return world;
}

std::uint32_t add_ball(World& world, const Vec3& place_m, const Vec3& velocity_m_s,
                       double mass_kg = 1.0) {
  const auto body = static_cast<std::uint32_t>(world.states.size());
  const double volume = 4.0 / 3.0 * M_PI * kBall_m * kBall_m * kBall_m;
  world.add_body(world.add_shape(Sphere{kBall_m}), place_m, mass_kg / volume, kIce)
      .linear_velocity_m_s = velocity_m_s;
  return body;
}

Joint rod(const World& world, std::uint32_t a, std::optional<std::uint32_t> b, const Vec3& to_m) {
  Joint joint = test::joint_at(JointKind::kDistance, world, a, b, world.states[a].position_m);
  joint.anchor_b_m = b ? Vec3::Zero() : to_m;
  joint.length_m = (to_m - world.states[a].position_m).norm();
  return joint;
}

double kinetic_joule(const World& world) {
  return measure(world.scene, world.ids, world.states).kinetic_energy_joule;
}

// The part of the energy of motion that a run of this time ends with.
double kept(World& world, double time_s) {
  const double before = kinetic_joule(world);
  world.run(static_cast<int>(std::lround(time_s / world.scene.dt_s)));
  return kinetic_joule(world) / before;
}

// It loses half of the square of the angle that it turns by in a step at most, and that once; each
// step its sixth power.
TEST(JointTurning, ABallOnATetherKeepsItsSpeedOnIce) {
  for (const double dt_s : {1.0 / 30.0, 1.0 / 60.0, 1.0 / 240.0})
    for (const double speed_m_s : {0.3, 1.0, 3.0, 9.0}) {
      World world = on_ice(dt_s);
      add_ball(world, Vec3(kArm_m, 0, kBall_m), Vec3(0, speed_m_s, 0));
      test::add(world, rod(world, 0, std::nullopt, Vec3(0, 0, kBall_m)));
      const double angle_rad = speed_m_s * dt_s / kArm_m, part = kept(world, 6.0);
      EXPECT_LE(part, 1.0 + 1e-12) << dt_s << " s, " << speed_m_s << " m/s";
      EXPECT_GE(part,
                1.0 - 0.5 * std::pow(angle_rad, 2) - 6.0 / dt_s * std::pow(angle_rad, 6) - 1e-12)
          << dt_s << " s, " << speed_m_s << " m/s";
    }
}

TEST(JointTurning, TwoBallsOnARodGoOnOverIceAsTheyTurn) {
  World world = on_ice(1.0 / 60.0);
  const Vec3 common(0.5, 0.2, 0);
  add_ball(world, Vec3(0.5, 0, kBall_m), common + Vec3(0, 2, 0));
  const std::uint32_t other = add_ball(world, Vec3(-0.5, 0, kBall_m), common - Vec3(0, 2, 0));
  test::add(world, rod(world, 0, other, world.states[other].position_m));
  EXPECT_GE(kept(world, 6.0), 0.99);
  const Vec3 centre = 0.5 * (world.states[0].position_m + world.states[1].position_m);
  EXPECT_LE((centre - 6.0 * common - Vec3(0, 0, kBall_m)).norm(), 1e-12);
}

// Balls of 1 kg in a row on ball joints, the last heavier, which turn about its end like one body.
double kept_by_chain(int balls, double heavier, double dt_s, double turn_rad_s) {
  constexpr double kSpacing = 0.3;
  World world = on_ice(dt_s);
  for (int i = 0; i < balls; ++i) {
    const Vec3 place(kSpacing * (i + 0.5), 0, kBall_m), anchor(kSpacing * i, 0, kBall_m);
    const std::uint32_t ball =
        add_ball(world, place, Vec3(0, turn_rad_s * place.x(), 0), i + 1 == balls ? heavier : 1.0);
    world.states[ball].angular_velocity_rad_s = Vec3(0, 0, turn_rad_s);
    const std::optional<std::uint32_t> next = i > 0 ? std::optional(ball) : std::nullopt;
    test::add(world,
              test::joint_at(JointKind::kBall, world, i > 0 ? ball - 1 : ball, next, anchor));
  }
  const double part = kept(world, 3.0);
  EXPECT_LE(part, 1.0 + 1e-12) << balls << ", " << heavier;
  return part;
}

TEST(JointTurning, AChainOfAnyNumberKeepsItsSpeedOnIce) {
  for (const int balls : {1, 2, 4, 9, 16, 30})
    EXPECT_GE(kept_by_chain(balls, 1.0, 1.0 / 60.0, 1.0), 0.995) << balls;
}

// However light it is, what lies between turns with it.
TEST(JointTurning, SoDoesAHeavyBallOnAChain) {
  for (const double heavier : {10.0, 100.0, 1e3, 1e5}) {
    EXPECT_GE(kept_by_chain(2, heavier, 1.0 / 60.0, 1.0), 0.999) << heavier;
    EXPECT_GE(kept_by_chain(2, heavier, 1.0 / 240.0, 4.0), 0.999) << heavier;
  }
  for (const double heavier : {10.0, 100.0, 1e3})
    EXPECT_GE(kept_by_chain(6, heavier, 1.0 / 60.0, 1.0), 0.97) << heavier;
}

// What is much stiffer than the step is damped, and stays taut.
TEST(JointTurning, LightBallsThatSwingFasterThanTheStepDoNotThrowTheirChain) {
  EXPECT_GE(kept_by_chain(6, 1e4, 1.0 / 240.0, 4.0), 0.75);
  EXPECT_GE(kept_by_chain(6, 1e4, 1.0 / 60.0, 1.0), 0.9);
}

// The box stands still, and its friction holds it.
TEST(JointTurning, ABallOnATetherToAHeavyBoxKeepsItsSpeed) {
  constexpr Material kRough{.friction = 0.6, .restitution = 0.0};
  for (const double box_kg : {10.0, 1e3, 1e5}) {
    World world = test::under_gravity();
    world.add_floor(kRough);
    world.add_body(world.add_shape(Box{Vec3::Constant(0.25)}), Vec3(0, 0, 0.25), 8.0 * box_kg,
                   kRough);
    const std::uint32_t ball = add_ball(world, Vec3(1.5, 0, kBall_m), Vec3(0, 1.5, 0));
    Joint joint = test::joint_at(JointKind::kDistance, world, 0, ball, Vec3(0, 0, kBall_m));
    joint.anchor_b_m = Vec3::Zero();
    joint.length_m = 1.5;
    test::add(world, joint);
    const double part = kept(world, 6.0);
    EXPECT_GE(part, 0.995) << box_kg;
    EXPECT_LE(part, 1.0 + 1e-9) << box_kg;
  }
}

// Against a step a sixteenth as long.
TEST(JointTurning, AFlailOnIceIsOfTheSecondOrder) {
  const auto end_at = [](int steps_a_second) {
    World world = on_ice(1.0 / steps_a_second);
    const std::uint32_t bar = world.add_shape(Box{Vec3(0.5, 0.05, 0.05)});
    for (const double x : {0.5, 1.5}) {
      BodyState& state = world.add_body(bar, Vec3(x, 0, 0.05), 1000.0, kIce);
      const double turn_rad_s = x < 1.0 ? 2.0 : 6.0;
      state.angular_velocity_rad_s = Vec3(0, 0, turn_rad_s);
      state.linear_velocity_m_s = Vec3(0, x < 1.0 ? 1.0 : 5.0, 0);
    }
    test::add(world, test::joint_at(JointKind::kHinge, world, 0, std::nullopt, Vec3(0, 0, 0.05)));
    test::add(world, test::joint_at(JointKind::kHinge, world, 0, 1, Vec3(1, 0, 0.05)));
    world.run(steps_a_second);
    return world.states[1].position_m;
  };
  const Vec3 reference = end_at(3840);
  const double coarse = (end_at(120) - reference).norm(), fine = (end_at(240) - reference).norm();
  EXPECT_LE(coarse, 1e-2);
  EXPECT_GE(std::log2(coarse / fine), 1.8);
}

}  // namespace
}  // namespace soda::physics
