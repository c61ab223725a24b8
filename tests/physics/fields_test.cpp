// Fields: gravity, and constant forces of the bodies' own. To the physics they are one thing.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "physics/measures/measures.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/pours.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

// The same scene without gravity, in which each body has it as a force.
World with_forces(World world) {
  for (BodyParams& body : world.scene.bodies) body.own_field_m_s2 = world.scene.gravity_m_s2;
  world.scene.gravity_m_s2 = Vec3::Zero();
  return world;
}

World balls_in_a_row() {
  World world = test::under_gravity();
  const Material bouncy{.friction = 0.3, .restitution = 0.8};
  world.add_floor(bouncy);
  const std::uint32_t ball = world.add_shape(Sphere{0.2});
  for (int i = 0; i < 6; ++i)
    world.add_body(ball, Vec3(0.41 * i, 0.01 * i, 0.5 + 0.1 * i), 1000.0, bouncy)
        .linear_velocity_m_s = Vec3(2.0 - i, 0, 0);
  return world;
}

World stack_of_boxes() {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{{0.3, 0.2, 0.1}});
  for (int i = 0; i < 8; ++i) world.add_body(box, Vec3(0.01 * i, 0, 0.1 + 0.2 * i));
  return world;
}

World chain(JointKind kind) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t link = world.add_shape(Box{{0.1, 0.05, 0.03}});
  for (std::uint32_t i = 0; i < 8; ++i) {
    world.add_body(link, Vec3(0.25 * i, 0, 0.8));
    const Vec3 anchor(0.25 * i - 0.125, 0, 0.8);
    Joint joint = i == 0 ? test::joint_at(kind, world, 0, std::nullopt, anchor, Vec3::UnitY())
                         : test::joint_at(kind, world, i, i - 1, anchor, Vec3::UnitY());
    if (kind == JointKind::kSpring) joint.stiffness_newton_m = 500.0;
    test::add(world, joint);
  }
  return world;
}

World top() {
  World world = test::under_gravity();
  world.add_body(world.add_shape(Cylinder{0.2, 0.1}), Vec3(0.3, 0, 0)).angular_velocity_rad_s =
      Vec3(0, 30, 20);
  test::add(world, test::joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  return world;
}

TEST(Fields, GravityGivenAsForcesMovesAllTheSameWay) {
  const std::pair<const char*, std::function<World()>> scenes[] = {
      {"balls", balls_in_a_row},
      {"stack", stack_of_boxes},
      {"poured", [] { return test::poured({}); }},
      {"poured balls", [] { return test::poured({.kind = test::Poured::kSpheres}); }},
      {"top", top},
      {"springs", [] { return chain(JointKind::kSpring); }},
      {"hinges", [] { return chain(JointKind::kHinge); }}};
  for (const auto& [name, make] : scenes) {
    World plain = make(), forced = with_forces(make());
    const Geometry one(plain.scene), two(forced.scene);
    for (int step = 0; step < 150; ++step) {
      plain.run(1, one);
      forced.run(1, two);
      for (std::size_t i = 0; i < plain.states.size(); ++i)
        ASSERT_TRUE(identical(plain.states[i], forced.states[i]))
            << name << ", step " << step << ", body " << i << ": "
            << first_difference(plain.states[i], forced.states[i]).field;
    }
    EXPECT_EQ(plain.counters.islands_at_rest, forced.counters.islands_at_rest) << name;
  }
}

// Swept boxes and times of impact know of it: from rest, too.
TEST(Fields, NothingIsDrivenThroughAWall) {
  for (const double newton : {1e1, 1e2, 1e3, 1e4, 1e5, 1e6})
    for (const Shape& shape : {Shape{Sphere{0.05}}, Shape{Box{{0.05, 0.05, 0.05}}},
                               Shape{Capsule{0.05, 0.1}}, Shape{Cylinder{0.05, 0.1}}}) {
      World world;
      const Material material{.friction = 0.3, .restitution = 0.4};
      world.add_static(world.add_shape(Box{{0.05, 5, 5}}), Vec3(1, 0, 0), Quat::Identity(),
                       material);
      world.add_body(world.add_shape(shape), Vec3(0, 0.3, 0.2), 1000.0, material);
      world.scene.bodies[0].own_field_m_s2 = Vec3(newton / world.scene.bodies[0].mass_kg, 0, 0);
      world.run(60);
      EXPECT_LT(world.states[0].position_m.x(), 0.91) << newton << " N, shape " << shape.index();
    }
}

TEST(Fields, WhatAForcePushesInVainRests) {
  constexpr double kFriction = 0.5;
  for (const double share : {0.0, 1e-9, 0.1, 0.5, 0.9, 0.99}) {
    World world = test::under_gravity();
    world.add_floor(Material{.friction = kFriction});
    const std::uint32_t box = world.add_shape(Box{{0.5, 0.5, 0.5}});
    for (int i = 0; i < 3; ++i) world.add_body(box, Vec3(0, 0, 0.5 + i), 1000.0, {kFriction});
    for (BodyParams& body : world.scene.bodies)
      body.own_field_m_s2 = Vec3(share / 3.0 * kFriction * test::kGravity, 0, 0);
    world.run(50);
    EXPECT_GE(world.counters.islands_at_rest, 45u) << share;
    EXPECT_EQ(world.states[2].linear_velocity_m_s, Vec3(Vec3::Zero())) << share;
  }
}

// Each is drawn to the other, and thrown back to where it started: x = d - a t^2 / 2.
TEST(Fields, TwoThatForcesPressTogetherBounceForEver) {
  constexpr double kFar_m = 1.0, kRadius_m = 0.1, kPull_m_s2 = 3.0;
  const double until_s = std::sqrt(2.0 * (kFar_m - kRadius_m) / kPull_m_s2);
  for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
    World world;
    world.scene.dt_s = dt;
    const Material elastic{.friction = 0.0, .restitution = 1.0};
    const std::uint32_t ball = world.add_shape(Sphere{kRadius_m});
    for (const double side : {-1.0, 1.0}) {
      world.add_body(ball, Vec3(side * kFar_m, 0, 0), 1000.0, elastic);
      world.scene.bodies.back().own_field_m_s2 = Vec3(-side * kPull_m_s2, 0, 0);
    }
    const Geometry geometry(world.scene);
    for (int step = 1; step * dt < 10.0; ++step) {
      world.run(1, geometry);
      const double phase = std::abs(std::remainder(step * dt, 2.0 * until_s));
      const double x = kFar_m - 0.5 * kPull_m_s2 * phase * phase;
      ASSERT_NEAR(world.states[1].position_m.x(), x, 1e-11) << "step " << step << " of " << dt;
      ASSERT_NEAR(world.states[0].position_m.x(), -x, 1e-11) << "step " << step << " of " << dt;
    }
  }
}

// Three boxes that overlap are pushed apart in flight while each is drawn another way, and before
// one of them comes off.
TEST(Fields, AnIslandInFlightKeepsTheMomentaThatForcesGive) {
  constexpr double kTogether_s = 0.06;
  for (const int steps : {10, 20, 80}) {
    World world;
    world.scene.dt_s = kTogether_s / steps;
    const std::uint32_t box = world.add_shape(Box{{0.5, 0.4, 0.3}});
    const Vec3 forces[] = {Vec3(900, 0, 50), Vec3(-1500, 20, 0), Vec3(100, -40, 300)};
    for (int i = 0; i < 3; ++i) {
      world.add_body(box, Vec3(0.95 * i, 0.1 * i, 0), 100.0).linear_velocity_m_s =
          Vec3(0.1 - 0.1 * i, 0, 0);
      world.scene.bodies.back().own_field_m_s2 = forces[i] / world.scene.bodies.back().mass_kg;
    }
    const Mechanics start = world.mechanics();
    Vec3 turned_newton_m_s = Vec3::Zero();
    const Geometry geometry(world.scene);
    for (int step = 0; step < steps; ++step) {
      const std::vector<BodyState> before = world.states;
      world.run(1, geometry);
      ASSERT_EQ(world.report.islands.front().bodies, 3u);
      for (std::size_t i = 0; i < before.size(); ++i)
        turned_newton_m_s +=
            0.5 * world.scene.dt_s *
            Vec3(before[i].position_m + world.states[i].position_m).cross(forces[i]);
    }
    const Mechanics end = world.mechanics();
    const Vec3 given = kTogether_s * (forces[0] + forces[1] + forces[2]);
    EXPECT_LT((end.linear_momentum_newton_s - start.linear_momentum_newton_s - given).norm(),
              1e-12 * given.norm());
    EXPECT_LT(
        (end.angular_momentum_newton_m_s - start.angular_momentum_newton_m_s - turned_newton_m_s)
            .norm(),
        1e-12 * turned_newton_m_s.norm());
  }
}

}  // namespace
}  // namespace soda::physics
