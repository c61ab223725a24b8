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
    EXPECT_GE(kept_by_chain(6, heavier, 1.0 / 60.0, 1.0), 0.999) << heavier;
}

// What is much stiffer than the step is damped, and stays taut.
TEST(JointTurning, LightBallsThatSwingFasterThanTheStepDoNotThrowTheirChain) {
  EXPECT_GE(kept_by_chain(6, 1e3, 1.0 / 240.0, 4.0), 0.99);
  EXPECT_GE(kept_by_chain(6, 1e4, 1.0 / 60.0, 1.0), 0.99);
  EXPECT_GE(kept_by_chain(12, 1e3, 1.0 / 240.0, 4.0), 0.99);
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
    const double before = test::energy_joule(world);  // the box sinks in by 1e-11 m
    EXPECT_GE(kept(world, 6.0), 0.995) << box_kg;
    EXPECT_LE(test::energy_joule(world) - before, 1e-9) << box_kg;
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

constexpr Material kRoughBox{.friction = 0.5, .restitution = 0.0};

// Capsules of .5 kg on ball joints, from `body` on, towards `way`. Returns the last.
std::uint32_t add_rope(World& world, std::uint32_t body, const Vec3& from_m, const Vec3& way,
                       int links, double link_m) {
  const std::uint32_t shape = world.add_shape(Capsule{0.03, 0.5 * link_m - 0.03});
  const double density =
      0.5 / mass_properties(world.scene.shapes[shape], world.scene.shapes).volume_m3;
  for (int i = 0; i < links; ++i) {
    const auto link = static_cast<std::uint32_t>(world.states.size());
    world.add_body(shape, from_m + way * (link_m * (i + 0.5)), density, kIce).orientation =
        turn_between(Vec3::UnitZ(), way);
    test::add(world,
              test::joint_at(JointKind::kBall, world, body, link, from_m + way * link_m * i));
    body = link;
  }
  return body;
}

double open_m(const World& world) {
  double largest = 0.0;
  for (const Joint& joint : world.scene.joints)
    if (joint.kind == JointKind::kBall)
      largest = std::max(largest, test::between_anchors(world, joint).norm());
  return largest;
}

// The rope's pull makes it swing faster than the step follows.
TEST(JointTurning, ATautRopeThatDragsABoxDoesNotFlutter) {
  constexpr int kSteps = 240;
  for (const int links : {3, 6, 12})
    for (const double box_kg : {100.0, 1000.0}) {
      World world = test::under_gravity();
      world.add_floor(kRoughBox);
      world.add_body(world.add_shape(Box{Vec3::Constant(0.4)}), Vec3(0, 0, 0.4),
                     box_kg / (0.8 * 0.8 * 0.8), kRoughBox);
      const Vec3 end(0.4, 0, 0.4);
      const std::uint32_t last = add_rope(world, 0, end, Vec3::UnitX(), links, 1.0 / 3.0);
      const double pull_newton = box_kg * test::kGravity;
      world.scene.bodies[last].own_field_m_s2 = Vec3(pull_newton / 0.5, 0, 0);
      world.run(kSteps);
      EXPECT_LE(open_m(world), 1e-9) << links << ", " << box_kg;
      const double moved_kg = box_kg + 0.5 * links;  // the box bears the rope
      const double speed = (pull_newton / moved_kg - kRoughBox.friction * test::kGravity) * kSteps *
                           world.scene.dt_s;
      EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), speed, 5e-3 * speed) << links;
    }
}

// A trolley that drives along its rail, and its load comes to a wall. The rope bends and becomes
// taut again: its joints are off by more before they come nearer.
TEST(JointTurning, ARopeWithALoadThatComesToAWallHolds) {
  for (double load_kg = 100.0; load_kg <= 2000.0; load_kg += 100.0) {
    World world = test::under_gravity();
    world.add_static(world.add_shape(Box{Vec3(0.25, 1.5, 0.9)}), Vec3(3, 0, 0.9), Quat::Identity(),
                     kRoughBox);
    world.add_body(world.add_shape(Box{Vec3(0.25, 0.25, 0.15)}), Vec3(0, 0, 6),
                   50.0 / (0.5 * 0.5 * 0.3), kRoughBox);
    Joint rail =
        test::joint_at(JointKind::kSlider, world, 0, std::nullopt, Vec3(0, 0, 6), Vec3::UnitX());
    rail.motor = JointMotor{.speed = -1.0, .most_push = 900.0};  // of the world against it
    test::add(world, rail);
    const std::uint32_t last = add_rope(world, 0, Vec3(0, 0, 5.85), -Vec3::UnitZ(), 6, 2.0 / 3.0);
    const auto load = static_cast<std::uint32_t>(world.states.size());
    world.add_body(world.add_shape(Box{Vec3::Constant(0.4)}), Vec3(0, 0, 1.45),
                   load_kg / (0.8 * 0.8 * 0.8), kRoughBox);
    test::add(world, test::joint_at(JointKind::kBall, world, last, load, Vec3(0, 0, 1.85)));
    world.run(480);
    EXPECT_GT(world.counters.contact_points, 0u) << load_kg;
    EXPECT_LE(open_m(world), 1e-9) << load_kg;
  }
}

}  // namespace
}  // namespace soda::physics
