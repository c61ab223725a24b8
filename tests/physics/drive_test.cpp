// Driven bodies: the law, lanes, and what it leaves alone.
#include "physics/forces/drive.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

Drive towards(const Vec3& velocity, double time_constant_s, double max_acceleration = 1e6) {
  return {.time_constant_s = time_constant_s,
          .max_acceleration_m_s2 = max_acceleration,
          .velocity_m_s = velocity,
          .lane = std::nullopt};
}

// One driven ball in free flight.
World driven(const Drive& drive, double dt_s) {
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  world.scene.drives = {drive};
  world.add_body(world.add_shape(Sphere{0.3}), Vec3::Zero());
  world.scene.bodies[0].drive = 0;
  return world;
}

// Each step multiplies the difference to the wanted velocity by tau / (tau + dt).
TEST(Drive, RelaxesByTheSameFactorInEveryStep) {
  World world = driven(towards(Vec3(1.5, -2.0, 0), 0.5), 0.01);
  const Geometry geometry(world.scene);
  double left = 1.0;
  for (int i = 0; i < 200; ++i) {
    world.run(1, geometry);
    left *= 0.5 / 0.51;
    ASSERT_NEAR(world.states[0].linear_velocity_m_s.x(), 1.5 * (1.0 - left), 1e-13);
    ASSERT_NEAR(world.states[0].linear_velocity_m_s.y(), -2.0 * (1.0 - left), 1e-13);
  }
}

// v(t) = wanted (1 - exp(-t / tau)). The step's error is of first order in dt: (1 + dt/tau)^-n is
// exp(-t/tau) (1 + t dt / (2 tau^2)) up to dt^2, so at t = tau it is off by wanted dt / (2 e tau).
TEST(Drive, ConvergesToTheExponentialAtFirstOrder) {
  const double tau = 0.5, wanted = 2.0, exact = wanted * (1.0 - std::exp(-1.0));
  for (const int steps : {50, 100, 200, 400}) {
    World world = driven(towards(Vec3(wanted, 0, 0), tau), tau / steps);
    world.run(steps);
    const double error = exact - world.states[0].linear_velocity_m_s.x();
    const double predicted = wanted / (2.0 * std::exp(1.0) * steps);
    EXPECT_NEAR(error, predicted, 2.0 * predicted / steps) << steps;
  }
}

TEST(Drive, DoesNotOvershootHoweverLongTheStep) {
  World world = driven(towards(Vec3(2, 0, 0), 0.001), 1.0);
  world.run(3);
  EXPECT_LE(world.states[0].linear_velocity_m_s.x(), 2.0);
  EXPECT_GT(world.states[0].linear_velocity_m_s.x(), 1.99);
}

TEST(Drive, AcceleratesEvenlyAtItsLimit) {
  World world = driven(towards(Vec3(30, 40, 0), 0.1, 5.0), 0.01);
  world.run(100);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), 3.0, 1e-12);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.y(), 4.0, 1e-12);
  EXPECT_NEAR(world.states[0].position_m.x(), 1.5, 1e-12);
}

TEST(Drive, LeavesFallingAlone) {
  World world = driven(towards(Vec3(1, 0, 7), 0.1), 0.01);
  world.run(100);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.z(), -kGravity, 1e-12);
  EXPECT_NEAR(world.states[0].position_m.z(), -0.5 * kGravity, 1e-12);
}

TEST(Drive, WithoutGravityPushesInEveryDirection) {
  World world = driven(towards(Vec3(1, 0, 7), 0.1), 0.01);
  world.scene.gravity_m_s2 = Vec3::Zero();
  world.run(300);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.z(), 7.0, 1e-9);
}

// On a smooth floor the body is in an island: the law is the same there.
TEST(Drive, ActsTheSameOnABodyInContact) {
  World world = driven(towards(Vec3(1.5, 0, 0), 0.5), 0.01);
  world.add_floor(Material{0.0, 0.0});
  world.states[0].position_m.z() = 0.3;
  world.run(100);
  EXPECT_GT(world.counters.islands_solved, 90u);
  EXPECT_EQ(world.counters.driven_bodies, 100u);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), 1.5 * (1.0 - std::pow(0.5 / 0.51, 100)),
              1e-12);
}

TEST(Drive, ItsImpulseIsTheMomentumThatAFreeBodyGains) {
  World world = driven(towards(Vec3(1.5, -1, 0), 0.5, 2.0), 0.01);
  world.scene.gravity_m_s2 = Vec3::Zero();
  const Vec3 given = drive_impulse(world.scene, world.ids, world.states).sum_newton_s;
  world.run(1);
  const Vec3 gained = world.mechanics().linear_momentum_newton_s;
  EXPECT_GT(given.norm(), 0.0);
  EXPECT_LT((gained - given).norm(), 1e-14 * given.norm());
}

TEST(Drive, BodiesWithoutOneAreNotTouched) {
  World world = driven(towards(Vec3(1.5, 0, 0), 0.5), 0.01);
  world.scene.bodies[0].drive = kNoDrive;
  world.run(10);
  EXPECT_EQ(world.states[0].linear_velocity_m_s.x(), 0.0);
  EXPECT_EQ(world.counters.driven_bodies, 0u);
  EXPECT_EQ(drive_impulse(world.scene, world.ids, world.states).scale_newton_s, 0.0);
}

// East to (10, 0), then north; two wide, on a hill that does not count.
Drive corner() {
  Drive drive = towards(Vec3::Zero(), 0.2, 5.0);
  drive.lane = Lane{.way_points_m = {Vec3(0, 0, 3), Vec3(10, 0, -2), Vec3(10, 10, 8)},
                    .half_width_m = 1.0,
                    .speed_m_s = 2.0};
  return drive;
}

Vec3 wanted_at(double x, double y) {
  return wanted_velocity(corner(), Vec3(0, 0, -kGravity), Vec3(x, y, 1.0));
}

TEST(Lane, RunsAlongTheNearestSegmentAndOnBeyondItsEnds) {
  EXPECT_LT((wanted_at(4, 0.9) - Vec3(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((wanted_at(-50, -0.9) - Vec3(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((wanted_at(10.5, 4) - Vec3(0, 2, 0)).norm(), 1e-15);
  EXPECT_LT((wanted_at(9.2, 70) - Vec3(0, 2, 0)).norm(), 1e-15);
}

TEST(Lane, TurnsAtTheBisectorInsideAndAtTheWayPointOutside) {
  EXPECT_LT((wanted_at(9.2, 0.7) - Vec3(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((wanted_at(9.4, 0.7) - Vec3(0, 2, 0)).norm(), 1e-15);
  EXPECT_LT((wanted_at(10.3, -0.3) - Vec3(0, 2, 0)).norm(), 1e-15);
}

TEST(Lane, SteersBackThoseWhoAreOutsideByHalfARightAngleAtTwiceItsWidth) {
  const double part = 2.0 / std::sqrt(2.0);
  EXPECT_LT((wanted_at(4, -2) - Vec3(part, part, 0)).norm(), 1e-14);
  EXPECT_LT((wanted_at(12, 5) - Vec3(-part, part, 0)).norm(), 1e-14);
  EXPECT_NEAR(wanted_at(4, -40).norm(), 2.0, 1e-14);
}

TEST(Lane, LeadsABodyRoundTheCorner) {
  World world = driven(corner(), 1.0 / 60.0);
  world.add_floor(Material{0.0, 0.0});
  world.states[0].position_m = Vec3(0, -3, 0.3);
  world.run(720);
  const BodyState& s = world.states[0];
  EXPECT_LT((s.linear_velocity_m_s - Vec3(0, 2, 0)).norm(), 1e-3);
  EXPECT_LT(std::abs(s.position_m.x() - 10.0), 1.01);
  EXPECT_GT(s.position_m.y(), 8.0);
}

TEST(Lane, AbsurdPlacesGiveFiniteVelocities) {
  for (const double x : {0.0, 1e12, -1e12}) {
    for (const double y : {0.0, 1e12, -1e12}) {
      EXPECT_NEAR(wanted_at(x, y).norm(), 2.0, 1e-12) << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace soda::physics
