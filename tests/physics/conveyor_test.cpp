// Surfaces of statics that move, and friction that carries bodies along.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

// A belt along a slope of `degrees`: a halfspace turned about y, whose surface runs up at `speed`.
struct Belt {
  World world = test::under_gravity();
  double angle;
  Vec3 uphill, normal;
  Belt(double degrees, double friction, double speed) : angle(degrees * M_PI / 180.0) {
    uphill = Vec3(-std::cos(angle), 0, std::sin(angle));
    normal = Vec3(std::sin(angle), 0, std::cos(angle));
    world.add_static(world.add_shape(HalfSpace{normal, 0.0}), Vec3::Zero(), Quat::Identity(),
                     Material{friction, 0.0});
    world.scene.statics.back().surface_velocity_m_s = uphill * speed;
  }
  BodyState& place_box(double friction) {
    BodyState& s = world.add_body(world.add_shape(Box{Vec3(0.5, 0.5, 0.25)}), normal * 0.25, 1000.0,
                                  Material{friction, 0.0});
    s.orientation = test::about(Vec3::UnitY(), angle);
    return s;
  }
  double speed_uphill() const { return world.states[0].linear_velocity_m_s.dot(uphill); }
};

// Sliding friction is mu m g as long as the box is slower than the belt, so after n steps it moves
// with mu g n dt, and after ceil(v / (mu g dt)) steps with the belt. The tolerance is what the
// solver leaves: iterations end at changes of 1e-10 of the largest impulse, which is of the order
// of m g dt = 0.16 m/s times the mass; a hundred iterations of that are 2e-9 m/s a step.
TEST(Conveyor, BringsABoxToItsSpeedInTheTimeThatCoulombPredictsAndKeepsItThere) {
  constexpr double kFriction = 0.4, kSpeed = 2.0;
  Belt belt(0.0, kFriction, kSpeed);
  belt.place_box(kFriction);
  const double gain = kFriction * kGravity * belt.world.scene.dt_s;
  const int steps = static_cast<int>(std::ceil(kSpeed / gain));
  ASSERT_EQ(steps, 31);
  const Geometry geometry(belt.world.scene);
  for (int i = 1; i < steps; ++i) {
    belt.world.run(1, geometry);
    ASSERT_NEAR(belt.speed_uphill(), gain * i, 1e-7) << "step " << i;
  }
  belt.world.run(1, geometry);
  EXPECT_NEAR(belt.speed_uphill(), kSpeed, 1e-8);
  const Vec3 there = belt.world.states[0].position_m;
  belt.world.run(120, geometry);
  EXPECT_NEAR(belt.speed_uphill(), kSpeed, 1e-9);
  const Vec3 displacement = belt.world.states[0].position_m - there;
  EXPECT_NEAR(displacement.dot(belt.uphill), kSpeed * 120 * belt.world.scene.dt_s, 1e-7);
  EXPECT_NEAR(displacement.y(), 0.0, 1e-9);
  EXPECT_GT(belt.world.counters.conveyor_rows, 0u);
}

TEST(Conveyor, CarriesABoxUpASlopeBelowTheFrictionAngle) {
  Belt belt(20.0, 0.5, 1.5);
  belt.place_box(0.5).linear_velocity_m_s = belt.uphill * 1.5;
  belt.world.run(60);  // the first contact settles into its slop
  const Vec3 settled = belt.world.states[0].position_m;
  belt.world.run(600);
  const Vec3 displacement = belt.world.states[0].position_m - settled;
  EXPECT_LT((displacement - belt.uphill * 15.0).norm(), 1e-8);
  EXPECT_NEAR(belt.speed_uphill(), 1.5, 1e-9);
}

// Above the friction angle the box slides down whatever the belt does.
TEST(Conveyor, CannotHoldABoxAboveTheFrictionAngle) {
  Belt belt(30.0, 0.2, 1.5);
  belt.place_box(0.2);
  belt.world.run(120);
  const double a = kGravity * (std::sin(belt.angle) - 0.2 * std::cos(belt.angle));
  EXPECT_NEAR(belt.speed_uphill(), -a * 2.0, 1e-6);
}

TEST(Conveyor, WithoutFrictionMovesNothingAndHasNoRows) {
  Belt belt(0.0, 0.4, 2.0);
  belt.place_box(0.0);
  belt.world.run(60);
  EXPECT_EQ(belt.world.states[0].linear_velocity_m_s.x(), 0.0);
  EXPECT_EQ(belt.world.counters.conveyor_rows, 0u);
  EXPECT_EQ(belt.world.counters.friction_rows, 0u);
}

// The belt under a sphere drives it and spins it: without slip its contact point has the belt's
// speed, which it reaches at v = 2/7 of it (m v = J, 2/5 m r^2 w = J r, v + r w = belt).
TEST(Conveyor, GivesASphereTwoSeventhsOfItsSpeed) {
  Belt belt(0.0, 0.5, 3.5);
  belt.world.add_body(belt.world.add_shape(Sphere{0.5}), Vec3(0, 0, 0.5), 1000.0,
                      Material{0.5, 0.0});
  belt.world.run(120);
  EXPECT_NEAR(belt.speed_uphill(), 1.0, 1e-8);
}

// What a velocity along the normal would do: lift what lies on the surface.
TEST(Conveyor, VelocityAlongTheNormalHasNoEffect) {
  Belt still(0.0, 0.5, 0.0), rising(0.0, 0.5, 0.0);
  rising.world.scene.statics.back().surface_velocity_m_s = Vec3(0, 0, 3.0);
  still.place_box(0.5);
  rising.place_box(0.5);
  still.world.run(60);
  rising.world.run(60);
  EXPECT_EQ(rising.world.digest_of_states(), still.world.digest_of_states());
}

// Two boxes on a belt each, so close that they are one island, but without pressing on each other.
TEST(Conveyor, TwoBeltsUnderOneIslandEachDriveWhatLiesOnThem) {
  World world = test::under_gravity();
  const std::uint32_t belt = world.add_shape(Box{Vec3(20, 1.9, 0.5)});
  const std::uint32_t box = world.add_shape(Box{});
  for (const double side : {-1.0, 1.0}) {
    world.add_static(belt, Vec3(0, 2 * side, -0.5));
    world.scene.statics.back().surface_velocity_m_s = Vec3(1.5 + 0.5 * side, 0, 0);
    world.add_body(box, Vec3(0, 0.5025 * side, 0.5));
  }
  world.run(1);
  ASSERT_EQ(world.report.islands.size(), 1u);
  EXPECT_EQ(world.report.islands[0].contact_points, 12u);
  world.run(60);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), 1.0, 1e-8);
  EXPECT_NEAR(world.states[1].linear_velocity_m_s.x(), 2.0, 1e-8);
}

TEST(Conveyor, ImpulseOfStaticsIsWhatTheBodyGained) {
  Belt belt(0.0, 0.4, 2.0);
  belt.place_box(0.4);
  belt.world.run(1);
  const double mass = belt.world.scene.bodies[0].mass_kg;
  ASSERT_EQ(belt.world.report.islands.size(), 1u);
  const Vec3 given = belt.world.report.islands[0].static_impulse_newton_s;
  EXPECT_NEAR(given.dot(belt.uphill), mass * belt.speed_uphill(), 1e-12 * mass);
  EXPECT_GT(belt.speed_uphill(), 0.0);
}

// That all bodies would have with the kinetic energy of them all.
double speed_of_all(const World& world) {
  double square = 0.0, mass = 0.0;
  for (std::size_t i = 0; i < world.states.size(); ++i) {
    const BodyParams& body = world.scene.bodies[i];
    const Vec3& angular_velocity = world.states[i].angular_velocity_rad_s;
    square += body.mass_kg * world.states[i].linear_velocity_m_s.squaredNorm() +
              angular_velocity.dot(Vec3(body.inertia_local_kg_m2 * angular_velocity));
    mass += body.mass_kg;
  }
  return std::sqrt(square / mass);
}

// A ball between floor and belt, dragged over a small one. Pressure locks such a wedge: Coulomb's
// law does not bound what the belt gives, and impulses grow until the iterations end.
struct Wedge {
  World world = test::under_gravity();
  Wedge(double small_m, const Material& material, double overlap_m, double speed) {
    world.add_floor(material);
    const double belt_m = 1.5 - overlap_m;
    world.add_static(world.add_shape(Box{Vec3(10, 10, 0.5)}), Vec3(0, 0, belt_m), Quat::Identity(),
                     material);
    world.scene.statics.back().surface_velocity_m_s = Vec3(speed, 0, 0);
    constexpr double kRadius = 0.45, kHigh = 1.0 - kRadius;
    world.add_body(world.add_shape(Sphere{kRadius}), Vec3(0, 0, kHigh), 1000.0, material);
    const double apart = kRadius + small_m, higher = kHigh - small_m;
    world.add_body(world.add_shape(Sphere{small_m}),
                   Vec3(std::sqrt(apart * apart - higher * higher), 0, small_m), 1000.0, material);
  }
};

TEST(Conveyor, GivesWhatIsJammedNoMoreThanItsOwnSpeed) {
  constexpr double kSpeed = 3.0;
  const double most = kSpeed + kGravity * test::under_gravity().scene.dt_s + 1e-6;
  for (const double small_m : {0.1, 0.15, 0.2, 0.3})
    for (const double friction : {0.5, 1.0, 2.0})
      for (const double restitution : {0.0, 0.5, 1.0})
        for (const double overlap_m : {0.0, 0.02, 0.1}) {
          Wedge wedge(small_m, Material{friction, restitution}, overlap_m, kSpeed);
          const Geometry geometry(wedge.world.scene);
          for (int step = 0; step < 60; ++step) {
            const double before = speed_of_all(wedge.world);
            wedge.world.run(1, geometry);
            ASSERT_LE(speed_of_all(wedge.world), before + most)
                << "small " << small_m << ", friction " << friction << ", restitution "
                << restitution << ", overlap " << overlap_m << ", step " << step;
          }
        }
}

// The last of a stack of springy boxes is deep in the belt: each of its strikes is a solve.
TEST(Conveyor, GivesAStackThatIsStruckAgainAndAgainNoMoreThanItsOwnSpeed) {
  constexpr double kSpeed = 19.0, kSize = 6.4;
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / 60.0;
  world.scene.solver.restitution_threshold_m_s = 0.006;
  world.add_floor(Material{0.7, 0.3});
  world.add_static(world.add_shape(Box{Vec3(160, 30, 7.3)}), Vec3(0, 0, 29.2), Quat::Identity(),
                   Material{0.9, 1.0});
  world.scene.statics.back().surface_velocity_m_s = Vec3(kSpeed, 0, 0);
  const std::uint32_t box = world.add_shape(Box{Vec3::Constant(0.5 * kSize)});
  const std::array<Material, 5> materials = {Material{0.7, 0.4}, Material{0.9, 1.0},
                                             Material{0.7, 0.3}, Material{0.9, 1.0},
                                             Material{0.0, 1.0}};
  for (int i = 0; i < 5; ++i)
    world.add_body(box, Vec3(0, 0, (i + 0.5) * kSize), 130.0, materials[i]);
  const Geometry geometry(world.scene);
  for (int step = 0; step < 20; ++step) {
    const double before = speed_of_all(world);
    world.run(1, geometry);
    ASSERT_LE(speed_of_all(world), before + kSpeed + kGravity * world.scene.dt_s) << step;
  }
}

}  // namespace
}  // namespace soda::physics
