// Forces, torques and damping of a body's own.
#include "physics/forces/forces.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

World one_body(const Shape& shape, const BodyForces& forces, double dt_s,
               const Vec3& force_newton = Vec3::Zero()) {
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  world.add_body(world.add_shape(shape), Vec3::Zero());
  world.scene.forces = {forces};
  BodyParams& body = world.scene.bodies[0];
  if (!(forces == BodyForces{})) body.forces = 0;
  body.own_field_m_s2 = force_newton / body.mass_kg;
  return world;
}

double angle_between(const Quat& a, const Quat& b) {
  return 2.0 * (a.conjugate() * b).vec().norm();
}

TEST(Forces, DecayIsTheExponentialAndItsIntegrals) {
  for (const double rate : {1e-12, 1e-6, 0.01, 0.3, 1.0, 7.0, 60.0, 1e3, 1e6}) {
    const double t = 0.4;
    const Decay decay = decay_over(rate, t);
    const double speed = -std::expm1(-rate * t) / rate;
    EXPECT_NEAR(decay.left, std::exp(-rate * t), 1e-15) << rate;
    EXPECT_NEAR(decay.speed_s / speed, 1.0, 1e-14) << rate;
    // The difference of two integrals, where that does not cancel.
    if (rate * t > 0.1) {
      EXPECT_NEAR(decay.displacement_s2 / ((t - speed) / rate), 1.0, 1e-13) << rate;
    } else {
      EXPECT_NEAR(decay.displacement_s2,
                  0.5 * t * t * (1.0 - rate * t / 3.0 + rate * t * rate * t / 12.0),
                  1e-7 * t * t * rate)
          << rate;
    }
  }
}

TEST(Forces, TheDisplacementUnderForceAndDampingIsExactForAnyStep) {
  const double c = 0.7, time = 6.0;
  for (const double dt : {1.0, 0.1, 0.01}) {
    World world = one_body(Sphere{0.3}, {.linear_damping_1_s = c}, dt, Vec3(40, 0, 500));
    world.states[0].linear_velocity_m_s = Vec3(3, -2, 1);
    world.run(static_cast<int>(time / dt + 0.5));
    const double mass = world.scene.bodies[0].mass_kg;
    const Vec3 a = Vec3(40, 0, 500) / mass - Vec3(0, 0, kGravity);
    const double speed = -std::expm1(-c * time) / c;
    const Vec3 exact = Vec3(3, -2, 1) * speed + a * ((time - speed) / c);
    EXPECT_LT((world.states[0].position_m - exact).norm(), 1e-12) << dt;
  }
}

TEST(Forces, ADampedTumblingBodyTurnsAsAFreeOneDoesSlower) {
  const double c = 0.5, time = 2.0;
  const Vec3 angular_velocity(0.3, 4.0, 0.2);
  World damped = one_body(Box{{0.5, 0.25, 0.1}}, {.angular_damping_1_s = c}, 0.02);
  damped.states[0].angular_velocity_rad_s = angular_velocity;
  damped.run(100);
  const int steps = 100;
  World free = one_body(Box{{0.5, 0.25, 0.1}}, {}, -std::expm1(-c * time) / c / steps);
  free.states[0].angular_velocity_rad_s = angular_velocity;
  free.run(steps);
  EXPECT_LT(angle_between(damped.states[0].orientation, free.states[0].orientation), 1e-12);
  const Vec3 left = damped.states[0].angular_velocity_rad_s * std::exp(c * time);
  EXPECT_LT((left - free.states[0].angular_velocity_rad_s).norm(), 1e-11);
}

TEST(Forces, ATorqueGivesItsAngularMomentumAndTheAttitudeConvergesAtSecondOrder) {
  const Vec3 torque(5.0, -3.0, 8.0);
  const auto ended = [&](int steps) {
    World world = one_body(Box{{0.5, 0.25, 0.1}}, {.torque_newton_m = torque}, 1.0 / steps);
    world.states[0].angular_velocity_rad_s = Vec3(0.5, 2.0, -1.0);
    const Vec3 before = world.mechanics().angular_momentum_newton_m_s;
    world.scene.gravity_m_s2 = Vec3::Zero();
    world.run(steps);
    EXPECT_LT((world.mechanics().angular_momentum_newton_m_s - before - torque).norm(), 1e-10);
    return world.states[0].orientation;
  };
  const Quat exact = ended(12800);
  const double coarse = angle_between(ended(50), exact), fine = angle_between(ended(100), exact);
  EXPECT_NEAR(coarse / fine, 4.0, 0.1);
}

// A force that turns with the body at w: v = F / (m w) (sin, 1 - cos).
TEST(Forces, AThrustTurnsWithItsBodyToSecondOrder) {
  double before = 0.0;
  for (const int steps : {50, 100, 200}) {
    World world = one_body(Sphere{0.3}, {.body_force_newton = Vec3(200, 0, 0)}, 1.0 / steps);
    world.scene.gravity_m_s2 = Vec3::Zero();
    world.states[0].angular_velocity_rad_s = Vec3(0, 0, 3.0);
    world.run(steps);
    const double a = 200.0 / world.scene.bodies[0].mass_kg;
    const Vec3 exact = Vec3(std::sin(3.0), 1.0 - std::cos(3.0), 0) * (a / 3.0);
    const double error = (world.states[0].linear_velocity_m_s - exact).norm();
    if (before > 0.0) {
      EXPECT_NEAR(before / error, 4.0, 0.05);
    }
    before = error;
  }
}

// A box on a floor whose friction holds up to 0.5 m g.
TEST(Forces, AForceOnABoxThatLiesMovesItOnceItBeatsFriction) {
  for (const bool wins : {false, true}) {
    World world = one_body(Box{{0.5, 0.5, 0.5}}, {}, 1.0 / 60);
    world.add_floor();
    world.states[0].position_m.z() = 0.5;
    world.scene.bodies[0].own_field_m_s2.x() = (wins ? 0.75 : 0.25) * kGravity;
    world.run(60);
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), wins ? 0.25 * kGravity : 0.0, 1e-6);
  }
}

// From rest, by up to thousands of its widths in a step.
TEST(Forces, WhatAThrusterOrADrivePushesPassesThroughNoWall) {
  for (const bool drives : {false, true})
    for (const double newton : {1e1, 1e2, 1e3, 1e4, 1e5, 1e6})
      for (const Shape& shape : {Shape{Sphere{0.05}}, Shape{Box{{0.05, 0.05, 0.05}}},
                                 Shape{Capsule{0.05, 0.1}}, Shape{Cylinder{0.05, 0.1}}}) {
        World world;
        world.add_static(world.add_shape(Box{{0.05, 5, 5}}), Vec3(1, 0, 0));
        world.add_body(world.add_shape(shape), Vec3(0, 0.3, 0.2));
        BodyParams& body = world.scene.bodies[0];
        if (drives) {
          world.scene.drives.push_back({.time_constant_s = 0.01,
                                        .max_acceleration_m_s2 = newton / body.mass_kg,
                                        .velocity_m_s = Vec3(200, 0, 0),
                                        .lane = std::nullopt});
          body.drive = 0;
        } else {
          world.scene.forces.push_back({.body_force_newton = Vec3(newton, 0, 0)});
          body.forces = 0;
        }
        world.run(60);
        EXPECT_LT(world.states[0].position_m.x(), 0.91)
            << (drives ? "drive" : "thruster") << " of " << newton << " N, shape " << shape.index();
      }
}

TEST(Forces, WhatDampingBrakesPassesThroughNoWall) {
  for (const double damping_1_s : {0.1, 1.0, 10.0, 60.0, 300.0})
    for (const double speed_m_s : {3.0, 30.0, 100.0, 300.0})
      for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
        World world;
        world.scene.dt_s = dt;
        world.add_static(world.add_shape(Box{{0.02, 5, 5}}), Vec3(1, 0, 0));
        world.add_body(world.add_shape(Sphere{0.05}), Vec3(0.3, 0, 0)).linear_velocity_m_s =
            Vec3(speed_m_s, 0, 0);
        world.scene.forces.push_back({.linear_damping_1_s = damping_1_s});
        world.scene.bodies[0].forces = 0;
        world.run(static_cast<int>(1.0 / dt));
        EXPECT_LT(world.states[0].position_m.x(), 0.94)
            << damping_1_s << " 1/s, " << speed_m_s << " m/s, " << dt;
      }
}

TEST(Forces, TheirImpulseIsWhatMomentumGains) {
  World world =
      one_body(Sphere{0.3}, {.body_force_newton = Vec3(0, 7, 0), .linear_damping_1_s = 0.8}, 0.02,
               Vec3(40, 0, 10));
  world.states[0].linear_velocity_m_s = Vec3(3, -2, 1);
  for (int i = 0; i < 50; ++i) {
    const Vec3 before = world.mechanics().linear_momentum_newton_s;
    const DriveImpulse impulse = drive_impulse(world.scene, world.ids, world.states);
    world.run(1);
    const Vec3 gained = world.mechanics().linear_momentum_newton_s - before;
    const Vec3 weight = world.scene.gravity_m_s2 * (world.scene.bodies[0].mass_kg * 0.02);
    ASSERT_LT((gained - weight - impulse.sum_newton_s).norm(), 1e-12 * gained.norm() + 1e-12);
  }
}

TEST(Forces, ABodyWithoutAnyIsNotTouched) {
  World with = one_body(Box{{0.5, 0.25, 0.1}}, {}, 0.02, Vec3(1, 2, 3));
  with.add_body(0, Vec3(5, 0, 0)).angular_velocity_rad_s = Vec3(1, 2, 3);
  World without = with;
  without.scene.bodies[0].own_field_m_s2 = Vec3::Zero();
  with.run(50);
  without.run(50);
  EXPECT_EQ(with.counters.forced_bodies, 50u);
  EXPECT_EQ(without.counters.forced_bodies, 0u);
  EXPECT_TRUE(identical(with.states[1], without.states[1]));
  EXPECT_FALSE(identical(with.states[0], without.states[0]));
}

}  // namespace
}  // namespace soda::physics
