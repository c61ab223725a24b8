// What is built and stands does so with rolling friction as it does without, however little that
// is: it asks for torques beside the forces, not for another solver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

World on_floor(double friction, double rolling_m, double torsional_m = 0.0) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / 60.0;
  world.add_floor({friction, 0.0, rolling_m, torsional_m});
  return world;
}

// Of the floor's material.
void add_box(World& world, const Vec3& half_m, const Vec3& place_m, double density) {
  world.add_body(world.add_shape(Box{half_m}), place_m, density, world.scene.statics[0].material);
}

struct Course {
  double deepest_m = 0.0, end_m = 0.0;  // overlap, and that of the last step
  bool rests = true;
  bool direct = false;  // Newton's method took part
};
Course run(int steps, World& world) {
  const Geometry geometry(world.scene);
  Course course;
  for (int step = 0; step < steps; ++step) {
    world.run(1, geometry);
    course.end_m = 0.0;
    course.rests = true;
    for (const IslandReport& island : world.report.islands) {
      course.end_m = std::max(course.end_m, island.max_penetration_m);
      course.rests = course.rests && island.rests;
      course.direct = course.direct || island.direct;
    }
    course.deepest_m = std::max(course.deepest_m, course.end_m);
  }
  return course;
}

// By iterations the lower ones sank in by more than their height.
TEST(RollingStructures, TowersBearBodiesThatAreMuchHeavier) {
  for (const int boxes : {3, 5, 8, 12})
    for (const double ratio : {20.0, 1e3, 1e5})
      for (const double rolling_m : {1e-8, 1e-6, 1e-4, 1e-2}) {
        World world = on_floor(0.5, rolling_m);
        for (int k = 0; k < boxes; ++k)
          add_box(world, Vec3(0.5, 0.5, 0.15), Vec3(0.01 * (k % 2), 0, 0.15 + 0.32 * k),
                  std::pow(ratio, k / (boxes - 1.0)));
        const Course course = run(150, world);
        EXPECT_LT(course.deepest_m, 0.01 * 0.3) << boxes << " " << ratio << " " << rolling_m;
        EXPECT_LT(course.end_m, 0.001 * 0.3) << boxes << " " << ratio << " " << rolling_m;
        EXPECT_EQ(world.mechanics().kinetic_energy_joule, 0.0)
            << boxes << " " << ratio << " " << rolling_m;
        EXPECT_TRUE(course.direct);
      }
}

TEST(RollingStructures, PyramidsRestFromTheFirstStepsOn) {
  for (const int rows : {5, 10, 20, 30})
    for (const double rolling_m : {1e-5, 1e-3})
      for (const double torsional_m : {0.0, 1e-3}) {
        World world = on_floor(0.6, rolling_m, torsional_m);
        for (int row = 0; row < rows; ++row)
          for (int k = 0; k < rows - row; ++k)
            add_box(world, Vec3(0.15, 0.1, 0.1), Vec3((k + 0.5 * row) * 0.31, 0, 0.1 + 0.2 * row),
                    1000.0);
        const Vec3 top_m = world.states.back().position_m;
        EXPECT_TRUE(run(10, world).rests) << rows << " " << rolling_m << " " << torsional_m;
        EXPECT_LT((world.states.back().position_m - top_m).norm(), 1e-9);
      }
}

// A brick's weight turns it about the edge below by its overhang beyond that; the edge bears all of
// it, so that rolling friction holds an overhang of its own length.
TEST(RollingStructures, ABrickOverhangsByTheLengthOfRollingFriction) {
  for (const double rolling_m : {1e-4, 1e-3, 5e-3})
    for (const double share : {0.9, 1.1}) {
      World world = on_floor(0.6, rolling_m);
      add_box(world, Vec3(0.15, 0.075, 0.075), Vec3(0, 0, 0.075), 1000.0);
      add_box(world, Vec3(0.15, 0.075, 0.075), Vec3(0.15 + share * rolling_m, 0, 0.225), 1000.0);
      run(240, world);
      if (share < 1.0)
        EXPECT_NEAR(world.states[1].position_m.z(), 0.225, 1e-9) << rolling_m;
      else
        EXPECT_LT(world.states[1].position_m.z(), 0.2) << rolling_m;
    }
}

// The ends of every other course overhang by less than that. At rest at once: what the torques have
// to be is found from course to course.
TEST(RollingStructures, WallsOfBricksThatOverhangRest) {
  for (const int courses : {5, 10, 20})
    for (const int bricks : {5, 10}) {
      World world = on_floor(0.6, 1e-3);
      for (int y = 0; y < courses; ++y)
        for (int k = 0; k < bricks; ++k)
          add_box(world, Vec3(0.15, 0.075, 0.075),
                  Vec3((k + 0.5 * (y % 2)) * 0.301, 0, 0.075 + 0.15 * y), 1000.0);
      EXPECT_TRUE(run(10, world).rests) << courses << " x " << bricks;
      EXPECT_LT(run(1, world).end_m, 1e-9);
    }
}

// What hits a stack is turned back by the hit's whole impulse, and by its weight for the rest of
// the step: by the coefficient times that, whatever the stack does.
TEST(RollingStructures, ABlowTurnsBackByItsImpulse) {
  for (const double speed_m_s : {1.0, 3.0, 8.0})
    for (const double rolling_m : {1e-3, 1e-2}) {
      World world = on_floor(0.0, rolling_m);
      for (int k = 0; k < 2; ++k)
        add_box(world, Vec3(0.5, 0.5, 0.15), Vec3(0, 0, 0.15 + 0.3 * k), 50);
      constexpr double kRadius_m = 0.1, kSpin_rad_s = 40.0;
      const double gap_m = 0.5 * speed_m_s * world.scene.dt_s;
      BodyState& ball =
          world.add_body(world.add_shape(Sphere{kRadius_m}), Vec3(0, 0, 0.6 + kRadius_m + gap_m),
                         1000.0, world.scene.statics[0].material);
      ball.linear_velocity_m_s.z() = -speed_m_s;
      ball.angular_velocity_rad_s.y() = kSpin_rad_s;
      world.run(1);
      const double stopped_m_s =
          speed_m_s + test::kGravity * world.scene.dt_s + world.states[2].linear_velocity_m_s.z();
      const double slower_rad_s = rolling_m * stopped_m_s / (0.4 * kRadius_m * kRadius_m);
      EXPECT_NEAR(kSpin_rad_s - world.states[2].angular_velocity_rad_s.y(), slower_rad_s,
                  5e-3 * slower_rad_s)
          << speed_m_s << " " << rolling_m;
    }
}

// Blows are shared out: by iterations the lower boxes jumped, and rocked on their edges for
// seconds.
TEST(RollingStructures, BoxesThatFallOnEachOtherLieStill) {
  const Vec3 sizes_m[] = {
      {0.418, 0.287, 0.387}, {0.238, 0.487, 0.475}, {0.391, 0.335, 0.267}, {0.332, 0.489, 0.353}};
  for (const double rolling_m : {0.0, 1e-8, 1e-6, 1e-4, 1e-2}) {
    World world = on_floor(0.5, rolling_m);
    for (int k = 0; k < 4; ++k) add_box(world, 0.5 * sizes_m[k], Vec3(0, 0, 0.4 + 0.6 * k), 300.0);
    const Course course = run(60, world);
    EXPECT_TRUE(course.rests) << rolling_m;
    EXPECT_LT(course.deepest_m, 2e-3) << rolling_m;
    for (const BodyState& state : world.states)
      EXPECT_LT(std::hypot(state.position_m.x(), state.position_m.y()), 1e-3) << rolling_m;
  }
}

}  // namespace
}  // namespace soda::physics
