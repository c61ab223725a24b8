#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

TEST(FreeBody, FallsExactly) {
  World world = test::under_gravity();
  BodyState& s = world.add_body(world.add_shape(Sphere{0.1}), Vec3::Zero());
  s.linear_velocity_m_s = Vec3(3, 0, 20);
  world.run(600);
  const double t = 600 * world.scene.dt_s;
  // Rounding alone: half a unit in the last place of 300 m and of 80 m/s per step, in random walk.
  EXPECT_NEAR(world.states[0].position_m.x(), 3 * t, 1e-12);
  EXPECT_NEAR(world.states[0].position_m.z(), 20 * t - 0.5 * kGravity * t * t, 1e-12);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.z(), 20 - kGravity * t, 1e-12);
}

TEST(FreeBody, ConstantAngularVelocityTurnsByTheExactAngle) {
  World world;
  BodyState& s = world.add_body(world.add_shape(Sphere{0.5}), Vec3::Zero());
  const Vec3 angular_velocity(1.0, -2.0, 3.0);
  s.angular_velocity_rad_s = angular_velocity;
  world.run(60);
  const Quat expected = test::about(angular_velocity, angular_velocity.norm());
  EXPECT_LT(world.states[0].orientation.angularDistance(expected), 1e-7);
  EXPECT_LT((world.states[0].orientation.toRotationMatrix() - expected.toRotationMatrix()).norm(),
            1e-13);
}

TEST(FreeBody, VeryFastRotationStaysAUnitRotationByTheExactAngle) {
  World world;
  BodyState& s = world.add_body(world.add_shape(Sphere{0.5}), Vec3::Zero());
  s.angular_velocity_rad_s = Vec3(0, 0, 6000.0);  // 100 rad a step
  world.run(1);
  const Mat3 expected = test::about(Vec3::UnitZ(), 100.0).toRotationMatrix();
  EXPECT_LT((world.states[0].orientation.toRotationMatrix() - expected).norm(), 1e-12);
}

TEST(Bounce, HeightsFollowThePowersOfRestitution) {
  World world = test::under_gravity();
  const Material bouncy{0.5, 0.8};
  world.add_floor();
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, 1.1), 1000.0, bouncy);
  const Geometry geometry(world.scene);
  double expected = 1.0, last_speed = 0.0;
  int apexes = 0;
  while (apexes < 10) {
    world.run(1, geometry);
    const double speed = world.states[0].linear_velocity_m_s.z();
    if (last_speed > 0.0 && speed <= 0.0) {
      const double apex = world.states[0].position_m.z() - 0.1 + speed * speed / (2 * kGravity);
      expected *= 0.64;
      EXPECT_NEAR(apex, expected, 1e-9) << "apex " << apexes;
      ++apexes;
    }
    last_speed = speed;
  }
}

TEST(Bounce, EndsAtRest) {
  World world = test::under_gravity();
  world.add_floor();
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, 1.1), 1000.0, Material{0.5, 0.5});
  world.run(300);
  EXPECT_NEAR(world.states[0].position_m.z(), 0.1, 1e-4);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.norm(), 0.0, 1e-9);
}

TEST(Bounce, HeadOnCollisionOfTwoMassesFollowsTheTextbook) {
  for (const double e : {0.0, 0.3, 1.0}) {
    World world;
    const Material material{0.0, e};
    world.add_body(world.add_shape(Sphere{0.2}), Vec3(0, 0, 0), 1000.0, material);
    world.add_body(world.add_shape(Sphere{0.1}), Vec3(0.5, 0, 0), 1000.0, material);
    world.states[0].linear_velocity_m_s = Vec3(3, 0, 0);
    world.states[1].linear_velocity_m_s = Vec3(-2, 0, 0);
    world.run(10);
    const double ma = world.scene.bodies[0].mass_kg, mb = world.scene.bodies[1].mass_kg;
    const double common = (ma * 3 + mb * -2) / (ma + mb);
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), common - e * 5 * mb / (ma + mb), 1e-12);
    EXPECT_NEAR(world.states[1].linear_velocity_m_s.x(), common + e * 5 * ma / (ma + mb), 1e-12);
  }
}

// Two elastic spheres that meet off-centre: the normal is the line of centres at the impact.
TEST(Bounce, ObliqueElasticCollisionConservesEnergyMomentumAndAngularMomentum) {
  World world;
  const std::uint32_t sphere = world.add_shape(Sphere{0.5});
  const Material elastic{0.0, 1.0};
  world.add_body(sphere, Vec3(-5, 0, 0), 1000.0, elastic).linear_velocity_m_s = Vec3(40, 0, 0);
  world.add_body(sphere, Vec3(5, 0.6, 0), 1000.0, elastic).linear_velocity_m_s = Vec3(-40, 0, 0);
  const Mechanics start = world.mechanics();
  world.run(30);
  const Mechanics end = world.mechanics();
  // At the impact the centres are 1 apart, 0.6 of it in y: the normal is (0.8, 0.6).
  const Vec3 normal(0.8, 0.6, 0);
  const Vec3 before(-80, 0, 0);
  const Vec3 after = before - 2.0 * normal * normal.dot(before);
  const Vec3 relative = world.states[1].linear_velocity_m_s - world.states[0].linear_velocity_m_s;
  EXPECT_LT((relative - after).norm(), 1e-9);
  EXPECT_NEAR(end.kinetic_energy_joule / start.kinetic_energy_joule, 1.0, 1e-12);
  EXPECT_LT((end.linear_momentum_newton_s - start.linear_momentum_newton_s).norm(),
            1e-13 * start.momentum_scale_newton_s);
  EXPECT_LT((end.angular_momentum_newton_m_s - start.angular_momentum_newton_m_s).norm(),
            1e-12 * start.angular_momentum_newton_m_s.norm());
}

TEST(Collisions, ConserveMomentumWhateverTheShapes) {
  std::mt19937_64 random(3);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  World world;
  const std::uint32_t shapes[] = {
      world.add_shape(Sphere{0.5}), world.add_shape(Box{Vec3(0.5, 0.4, 0.3)}),
      world.add_shape(Capsule{0.3, 0.6}), world.add_shape(Cylinder{0.4, 0.8})};
  for (int i = 0; i < 64; ++i) {
    const Vec3 at(i % 4 * 1.3, i / 4 % 4 * 1.3, i / 16 * 1.3);
    BodyState& s = world.add_body(shapes[i % 4], at, 1000.0, Material{0.4, i % 2 ? 0.7 : 0.0});
    s.linear_velocity_m_s = -2.0 * (at - Vec3(2, 2, 2)) + Vec3(unit(), unit(), unit());
    s.angular_velocity_rad_s = 3.0 * Vec3(unit(), unit(), unit());
  }
  const Mechanics start = world.mechanics();
  world.run(60);
  const Mechanics end = world.mechanics();
  ASSERT_GT(world.counters.contact_points, 1000u);
  EXPECT_LT((end.linear_momentum_newton_s - start.linear_momentum_newton_s).norm(),
            1e-13 * start.momentum_scale_newton_s);
}

// An incline is a halfspace turned about the y axis; down the slope is +x'.
struct Incline {
  World world = test::under_gravity();
  double angle;
  Vec3 down, up;
  Incline(double degrees, double friction) : angle(degrees * M_PI / 180.0) {
    down = Vec3(std::cos(angle), 0, -std::sin(angle));
    up = Vec3(std::sin(angle), 0, std::cos(angle));
    world.add_static(world.add_shape(HalfSpace{up, 0.0}), Vec3::Zero(), Quat::Identity(),
                     Material{friction, 0.0});
  }
  BodyState& place(const Shape& shape, double height, double friction) {
    BodyState& s =
        world.add_body(world.add_shape(shape), up * height, 1000.0, Material{friction, 0.0});
    s.orientation = test::about(Vec3::UnitY(), angle);
    return s;
  }
};

TEST(Friction, HoldsABoxOnASlopeBelowTheFrictionAngle) {
  Incline incline(20.0, 0.5);
  incline.place(Box{}, 0.5, 0.5);
  incline.world.run(60);  // the first contact settles into its slop
  const Vec3 settled = incline.world.states[0].position_m;
  incline.world.run(600);
  EXPECT_LT((incline.world.states[0].position_m - settled).norm(), 1e-9);
  EXPECT_LT((settled - incline.up * 0.5).norm(), 1e-4);
}

TEST(Friction, SlidingAccelerationIsCoulombsStraightDownTheSlope) {
  Incline incline(30.0, 0.2);
  incline.place(Box{}, 0.5, 0.2);
  incline.world.run(120);
  const double a = kGravity * (std::sin(incline.angle) - 0.2 * std::cos(incline.angle));
  const Vec3& v = incline.world.states[0].linear_velocity_m_s;
  EXPECT_NEAR(v.dot(incline.down), a * 2.0, 1e-6);
  EXPECT_NEAR(v.y(), 0.0, 1e-9);
  EXPECT_NEAR(v.dot(incline.up), 0.0, 1e-6);
}

TEST(Friction, StopsASlidingBoxAtTheCoulombRate) {
  for (const double azimuth : {0.0, 0.5, 0.785}) {
    World world = test::under_gravity();
    world.add_floor(Material{0.3, 0.0});
    BodyState& s =
        world.add_body(world.add_shape(Box{}), Vec3(0, 0, 0.5), 1000.0, Material{0.3, 0.0});
    const Vec3 along(std::cos(azimuth), std::sin(azimuth), 0);
    s.linear_velocity_m_s = 3.0 * along;
    world.run(30);
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.dot(along), 3.0 - 0.3 * kGravity * 0.5, 1e-6);
    world.run(60);
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.norm(), 0.0, 1e-9);
  }
}

TEST(Friction, LetsASphereRollDownASlope) {
  Incline incline(20.0, 0.5);
  incline.place(Sphere{0.5}, 0.5, 0.5);
  incline.world.run(120);
  const double a = 5.0 / 7.0 * kGravity * std::sin(incline.angle);
  const BodyState& s = incline.world.states[0];
  EXPECT_NEAR(s.linear_velocity_m_s.dot(incline.down), a * 2.0, 1e-6);
  EXPECT_NEAR(s.angular_velocity_rad_s.y() * 0.5, a * 2.0, 1e-6);
}

TEST(Stages, WithoutFrictionRestitutionOrContactsThereAreNoSuchRows) {
  World world = test::under_gravity();
  world.add_floor(Material{0.5, 0.0});
  const std::uint32_t box = world.add_shape(Box{});
  world.add_body(box, Vec3(0, 0, 0.5), 1000.0, Material{0.0, 0.0});
  world.run(10);
  EXPECT_GT(world.counters.normal_rows, 0u);
  EXPECT_EQ(world.counters.friction_rows, 0u);
  EXPECT_EQ(world.counters.restitution_rows, 0u);
  World free_world = test::under_gravity();
  free_world.add_body(free_world.add_shape(Box{}), Vec3(0, 0, 0.5));
  free_world.run(10);
  EXPECT_EQ(free_world.counters.normal_rows, 0u);
  EXPECT_EQ(free_world.counters.islands_solved, 0u);
  EXPECT_EQ(free_world.counters.free_bodies_advanced, 10u);
}

TEST(Stages, WithoutContactResponseBodiesPassThroughAndContactsAreStillFound) {
  World world = test::under_gravity();
  world.scene.solver.contact_response = false;
  world.add_floor();
  world.add_body(world.add_shape(Box{}), Vec3(0, 0, 1.0));
  world.run(60);
  EXPECT_NEAR(world.states[0].position_m.z(), 1.0 - 0.5 * kGravity, 1e-9);
  EXPECT_GT(world.counters.contact_points, 0u);
  EXPECT_EQ(world.counters.islands_solved, 0u);
  EXPECT_EQ(world.counters.normal_rows, 0u);
}

TEST(Stages, RestingBodiesAreWarmStartedUnlessSwitchedOff) {
  for (const bool warm : {true, false}) {
    World world = test::under_gravity();
    world.scene.solver.warm_starting = warm;
    world.scene.solver.rest = false;
    world.add_floor();
    world.add_body(world.add_shape(Box{}), Vec3(0, 0, 0.5));
    world.run(10);
    EXPECT_EQ(world.counters.warm_started_rows, warm ? 36u : 0u);
  }
}

TEST(IslandReport, StaticImpulseIsWhatGravityTakes) {
  World world = test::under_gravity();
  world.add_floor();
  world.add_body(world.add_shape(Box{}), Vec3(2, 0, 0.5));
  world.run(60);
  ASSERT_EQ(world.report.islands.size(), 1u);
  const IslandReport& report = world.report.islands[0];
  const double weight = 1000.0 * kGravity * world.scene.dt_s;
  EXPECT_NEAR(report.static_impulse_newton_s.z(), weight, 1e-9 * weight);
  EXPECT_NEAR(report.static_angular_impulse_newton_m_s.y(), -2.0 * weight, 1e-6 * weight);
  EXPECT_EQ(report.bodies, 1u);
  EXPECT_EQ(report.contact_points, 4u);
  EXPECT_LT(report.constraint_residual_m_s, 1e-9);
}

TEST(FastSpheres, DoNotPassAThinWallOrAFloorAtAnySpeed) {
  for (const double speed : {10.0, 300.0, 5000.0}) {
    World world;
    world.add_static(world.add_shape(Box{Vec3(0.005, 2, 2)}), Vec3(1, 0, 0));
    BodyState& s = world.add_body(world.add_shape(Sphere{0.01}), Vec3(0.3, 0.1, 0.2), 1000.0,
                                  Material{0.5, 0.5});
    s.linear_velocity_m_s = Vec3(speed, 0, 0);
    world.run(30);
    EXPECT_LT(world.states[0].position_m.x(), 0.985 + 1e-4) << speed;
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), -0.5 * speed, 1e-9 * speed);
  }
}

TEST(FastSpheres, ThatMissAreNotDeflected) {
  World world;
  world.add_static(world.add_shape(Box{Vec3(0.5, 0.5, 0.5)}));
  BodyState& s = world.add_body(world.add_shape(Sphere{0.1}), Vec3(-0.3, -1.2, 0));
  s.linear_velocity_m_s = Vec3(-60, 60, 0);  // passes the corner at a distance
  world.run(5);
  EXPECT_EQ(world.states[0].linear_velocity_m_s, Vec3(-60, 60, 0));
}

}  // namespace
}  // namespace soda::physics
