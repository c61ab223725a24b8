// Cars: a box on four wheels with motors, over hills of triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr double kWheelWidth_m = 0.15;

TriangleMesh hills(double height_m) {
  constexpr std::uint32_t kCells = 40;
  constexpr double kCell_m = 0.4;
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y <= kCells; ++y)
    for (std::uint32_t x = 0; x <= kCells; ++x)
      mesh.vertices_m.push_back(Vec3(kCell_m * x - 8, kCell_m * y - 8,
                                     height_m * std::sin(0.32 * x) * std::cos(0.28 * y)));
  for (std::uint32_t y = 0; y < kCells; ++y)
    for (std::uint32_t x = 0; x < kCells; ++x) {
      const std::uint32_t corner = y * (kCells + 1) + x, above = corner + kCells + 1;
      mesh.triangles.push_back({corner, corner + 1, above + 1});
      mesh.triangles.push_back({corner, above + 1, above});
    }
  return mesh;
}

void add_car(World& world, double y_m, double motor_rad_s) {
  const Material rubber{.friction = 0.8, .restitution = 0.7}, steel{.friction = 0.6};
  const auto chassis = static_cast<std::uint32_t>(world.states.size());
  world.add_body(world.add_shape(Box{Vec3(0.6, 0.3, 0.125)}), Vec3(-5, y_m, 0.9), 550.0, steel);
  const std::uint32_t wheel = world.add_shape(Cylinder{0.22, kWheelWidth_m});
  for (const double x : {-0.4, 0.4})
    for (const double side : {-0.42, 0.42}) {
      const Vec3 hub(-5 + x, y_m + side, 0.75);
      const auto body = static_cast<std::uint32_t>(world.states.size());
      world.add_body(wheel, hub, 350.0, rubber).orientation =
          test::about(Vec3::UnitX(), 0.5 * 3.14159265358979);
      Joint axle = test::joint_at(JointKind::kHinge, world, chassis, body, hub, Vec3::UnitY());
      axle.motor = JointMotor{.speed = motor_rad_s, .most_push = 40.0};
      test::add(world, axle);
    }
}

World cars_on_hills(double height_m, int cars, double motor_rad_s) {
  World world = test::under_gravity();
  for (int car = 0; car < cars; ++car) add_car(world, 2.0 * car - 3.0, motor_rad_s);
  world.add_static(world.add_shape(hills(height_m)), Vec3::Zero(), Quat::Identity(),
                   {.friction = 0.7, .restitution = 0.1});
  return world;
}

// A wheel that comes down because the others have hit was on no way to the hill when the step
// began.
TEST(Vehicles, WheelsSinkIntoNoHill) {
  for (const double height_m : {0.1, 0.25, 0.4})
    for (const double motor_rad_s : {-4.0, 5.0, 20.0}) {
      World world = cars_on_hills(height_m, 1, motor_rad_s);
      const Geometry geometry(world.scene);
      double deepest_m = 0.0;
      for (int step = 0; step < 200; ++step) {
        world.run(1, geometry);
        for (const IslandReport& island : world.report.islands)
          deepest_m = std::max(deepest_m, island.max_penetration_m);
      }
      EXPECT_LT(deepest_m, 0.01 * kWheelWidth_m) << height_m << " " << motor_rad_s;
      EXPECT_LT(test::largest_gap_m(world), 1e-9) << height_m << " " << motor_rad_s;
    }
}

// What stays as it was needs one factorisation, of five bodies: Newton's method starts from the
// velocities and impulses of the step before, those of joints as well as those of contacts.
// A wheel that hardly touches may need one more now and then.
TEST(Vehicles, AreHeldOnAHillByTheirMotorsWithHardlyMoreThanOneFactorisationAStep) {
  constexpr int kSteps = 100, kPlaces = 60;
  constexpr std::uint64_t kFactorisation = 1512;  // multiplications
  for (const int cars : {1, 2}) {
    std::uint64_t done = 0;
    for (int place = 0; place < kPlaces; ++place) {
      World world = cars_on_hills(0.1, cars, 0.0);
      for (BodyState& state : world.states) state.position_m.y() += 0.01 * place;
      const Geometry geometry(world.scene);
      world.run(400, geometry);
      const std::uint64_t before = world.counters.factor_multiplications;
      world.run(kSteps, geometry);
      done += world.counters.factor_multiplications - before;
    }
    EXPECT_GE(done, kPlaces * kSteps * cars * kFactorisation) << cars;
    EXPECT_LE(done, 1.4 * kPlaces * kSteps * cars * kFactorisation) << cars;
  }
}

// Cars that drive into each other press in circles, and iterations that get nowhere end.
TEST(Vehicles, NoStepTakesThousandsOfIterations) {
  World world = cars_on_hills(0.25, 4, 10.0);
  const Geometry geometry(world.scene);
  std::uint64_t before = 0, most = 0;
  for (int step = 0; step < 400; ++step) {
    world.run(1, geometry);
    most = std::max(most, world.counters.solver_iterations - before);
    before = world.counters.solver_iterations;
  }
  EXPECT_LT(most, 4000u);
}

}  // namespace
}  // namespace soda::physics
