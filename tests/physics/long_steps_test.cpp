// Steps in which a body would fall farther than its own size.
#include <gtest/gtest.h>

#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics::test {
namespace {

constexpr double kSize = 1e-3, kStep = 1.0 / 60.0;  // g dt^2 is 2.7 sizes

// Rests on a floor for a second, turned as said; returns how far its centre went.
double displacement_of(const Shape& shape, double height, const Quat& orientation) {
  World world = under_gravity();
  world.scene.dt_s = kStep;
  world.add_floor();
  const Vec3 start(0.0, 0.0, height);
  world.add_body(world.add_shape(shape), start).orientation = orientation;
  double displacement = 0.0;
  for (int i = 0; i < 60; ++i) {
    world.run(1);
    displacement = std::max(displacement, (world.states[0].position_m - start).norm());
  }
  return displacement;
}

TEST(LongSteps, ABoxRestsOnAnyOfItsFaces) {
  constexpr double kRight = 1.5707963267948966;
  const Box box{Vec3::Constant(0.5 * kSize)};
  for (const double angle : {0.0, kRight, 2.0 * kRight, 3.0 * kRight})
    for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY())})
      EXPECT_LT(displacement_of(box, 0.5 * kSize, about(axis, angle)), 1e-6 * kSize)
          << angle << " about " << axis.transpose();
}

TEST(LongSteps, ACylinderRestsOnEitherEndAndLying) {
  constexpr double kRight = 1.5707963267948966;
  const Cylinder cylinder{0.5 * kSize, kSize};
  for (const double angle : {0.0, kRight, 2.0 * kRight, 3.0 * kRight})
    EXPECT_LT(displacement_of(cylinder, 0.5 * kSize, about(Vec3::UnitX(), angle)), 1e-3 * kSize)
        << angle;
}

TEST(LongSteps, AContactIsWithWhatIsLow) {
  World world = under_gravity();
  world.scene.dt_s = kStep;
  world.add_floor();
  world.add_body(world.add_shape(Box{Vec3::Constant(0.5 * kSize)}), Vec3(0, 0, 0.5 * kSize));
  const auto manifolds = contacts_of(world, BodyId{0}, static_id(0));
  ASSERT_EQ(manifolds.size(), 1u);
  ASSERT_EQ(manifolds[0].count, 4u);
  for (const ContactPoint& p : manifolds[0].points) EXPECT_LT(p.separation_m, 1e-9);
}

// It falls on the floor from ten of its sizes, rolls over it, and all that within one step.
TEST(LongSteps, AHullThatFallsAndRollsStaysAboveTheFloor) {
  World world = under_gravity();
  world.scene.dt_s = 0.1;
  world.add_floor(Material{.friction = 2.0, .restitution = 0.0});
  const std::vector<Vec3> corners{
      Vec3(0.0002, -1.3e-05, -0.00038),  Vec3(0.00059, -0.00042, -0.00016),
      Vec3(0.00085, 0.00043, 0.00011),   Vec3(-7.9e-05, 0.00015, 0.00057),
      Vec3(-0.00075, 0.0007, -0.0002),   Vec3(-0.0008, 0.00017, 0.00041),
      Vec3(-0.00064, -0.00022, -0.0008), Vec3(-6.9e-05, -0.00086, -0.00052),
      Vec3(-0.00012, 0.00018, 0.00087),  Vec3(-0.00022, 9.8e-06, -0.00094),
      Vec3(0.00069, 0.00036, -0.0002),   Vec3(-0.00063, -4.9e-05, -0.00012),
      Vec3(-0.00025, -0.00072, 0.00068)};
  BodyState& hull = world.add_body(world.add_shape(std::get<ConvexHull>(make_convex_hull(corners))),
                                   Vec3(0.0093, 0.0065, 0.016), 1000.0,
                                   Material{.friction = 1.2, .restitution = 0.0});
  hull.orientation =
      Quat(0.12694323632740057, -0.2532827343871511, -0.11435995242981822, 0.9521843689603098)
          .normalized();
  hull.angular_velocity_rad_s = Vec3(17.0, -5.6, 8.8);
  for (int i = 0; i < 20; ++i) {
    world.run(1);
    EXPECT_GT(world.states[0].position_m.z(), 0.0) << i;
  }
}

// Iterations do not come to an end between bodies of 1 kg and what is a millionth as heavy. The
// light capsule overlaps the floor from the start, so that no displacement of it leads there.
TEST(LongSteps, WhatIsLightBetweenHeavyBodiesIsNotThrownThroughTheFloor) {
  World world;
  world.scene.dt_s = 0.1;
  world.add_floor(Material{.friction = 0.0, .restitution = 0.0});
  const auto add = [&world](const Shape& shape, double mass_kg, const Vec3& position_m,
                            double friction, double restitution) -> BodyState& {
    const std::uint32_t index = world.add_shape(shape);
    return world.add_body(index, position_m, mass_kg / mass_properties(shape).volume_m3,
                          Material{.friction = friction, .restitution = restitution});
  };
  add(Capsule{0.01, 0.01}, 5e-7, Vec3(0.003, 0.004, 8e-4), 1.0, 0.0).orientation =
      Quat(-0.8337218313448931, -0.5059905420627011, 0.12048205526217075, 0.18537948549344618)
          .normalized();
  add(Sphere{0.0035}, 1.0, Vec3(-8e-4, -0.002, 0.006), 0.0, 0.0);
  add(Box{Vec3(0.0015, 0.002, 0.0015)}, 1.0, Vec3(0.002, 0.006, 0.003), 0.0, 0.0);
  add(Sphere{0.0015}, 4e-6, Vec3(0.002, 0.003, 0.002), 0.0, 1.0).linear_velocity_m_s =
      Vec3(-0.7, -0.5, 0.6);
  add(Box{Vec3(5e-4, 0.002, 5e-4)}, 1.0, Vec3(0.004, -0.007, 0.002), 1.0, 0.0)
      .angular_velocity_rad_s = Vec3(40.0, -50.0, 30.0);
  add(Sphere{5e-4}, 1.0, Vec3(0.004, 0.002, 0.005), 0.0, 0.0);
  const double before = world.mechanics().kinetic_energy_joule;
  world.run(1);
  EXPECT_GT(world.states[0].position_m.z(), 0.0);
  EXPECT_LE(world.mechanics().kinetic_energy_joule, before * (1.0 + 1e-12));
}

// In a step of .1 s it turns up to eight times; contacts know the points that it began on.
TEST(LongSteps, ABoxThatRotatesFastOnAFloorDoesNotGetThroughIt) {
  std::mt19937_64 random(5);
  const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
  for (int trial = 0; trial < 100; ++trial) {
    World world = under_gravity();
    world.scene.dt_s = 0.1;
    world.add_floor(Material{.friction = 1.0, .restitution = 0.0});
    BodyState& box = world.add_body(world.add_shape(Box{Vec3(1e-3, 2e-3, 3e-3)}), Vec3(0, 0, 3e-3),
                                    1000.0, Material{.friction = 1.0, .restitution = 0.0});
    box.orientation = Quat(unit(), unit(), unit(), unit()).normalized();
    box.angular_velocity_rad_s = 500.0 * Vec3(unit(), unit(), unit());
    box.linear_velocity_m_s = Vec3(unit(), unit(), unit());
    for (int i = 0; i < 10; ++i) {
      const Mechanics before = world.mechanics();
      world.run(1);
      double correction_joule = 0.0;
      const Vec3 weight_newton_s =
          world.scene.gravity_m_s2 * world.scene.bodies[0].mass_kg * world.scene.dt_s;
      Vec3 given = weight_newton_s;
      for (const IslandReport& island : world.report.islands) {
        correction_joule += island.push_out_work_joule;
        given += island.static_impulse_newton_s;
      }
      const Mechanics now = world.mechanics();
      ASSERT_GT(world.states[0].position_m.z(), 0.0) << trial << ", step " << i;
      EXPECT_LE(now.kinetic_energy_joule + now.potential_energy_joule,
                (before.kinetic_energy_joule + before.potential_energy_joule) * (1.0 + 1e-9) +
                    correction_joule)
          << trial << ", step " << i;
      const Vec3 got = now.linear_momentum_newton_s - before.linear_momentum_newton_s;
      EXPECT_LT((got - given).norm(),
                1e-12 * (weight_newton_s.norm() + before.momentum_scale_newton_s))
          << trial << ", step " << i;
    }
  }
}

}  // namespace
}  // namespace soda::physics::test
