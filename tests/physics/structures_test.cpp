// Structures that are high for their bodies' size: walls, towers, pyramids.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "physics/solvers/substeps.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

const Box kBrick{Vec3(0.125, 0.06, 0.0325)};

// Courses of bricks, each half a brick beside the one below.
World wall(int bricks, int courses, bool direct) {
  World world = test::under_gravity();
  world.scene.solver.direct = direct;
  world.add_floor();
  const std::uint32_t shape = world.add_shape(kBrick);
  const double length = 2.002 * kBrick.half_extents_m.x(), height = 2 * kBrick.half_extents_m.z();
  for (int course = 0; course < courses; ++course)
    for (int i = 0; i < bricks - course % 2; ++i)
      world.add_body(shape, Vec3((i + 0.5 * (course % 2)) * length, 0, (course + 0.5) * height));
  return world;
}

World pyramid(int rows, bool direct) {
  World world = test::under_gravity();
  world.scene.solver.direct = direct;
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{Vec3(0.15, 0.15, 0.15)});
  for (int row = 0; row < rows; ++row)
    for (int i = 0; i < rows - row; ++i)
      world.add_body(box, Vec3((i + 0.5 * row) * 0.302, 0, 0.15 + 0.3 * row));
  return world;
}

double most_sunk_m(const World& world, const World& start) {
  double most = 0.0;
  for (std::size_t i = 0; i < world.states.size(); ++i)
    most = std::max(most, (world.states[i].position_m - start.states[i].position_m).norm());
  return most;
}

TEST(Structures, WhatIsBuiltAtRestIsFoundToRestAtOnce) {
  for (const World& start : {wall(24, 24, true), wall(12, 40, true), pyramid(30, true)}) {
    World world = start;
    world.run(3);
    EXPECT_EQ(world.counters.direct_islands, 1u);
    EXPECT_LT(most_sunk_m(world, start), 1e-9);
    EXPECT_EQ(world.mechanics().kinetic_energy_joule, 0.0);
  }
}

// Eight substeps let them give way so far that they rock until they fall.
TEST(Structures, StandInSubstepsAsWell) {
  for (const World& start : {wall(8, 24, false), wall(24, 8, false), pyramid(24, false)}) {
    World world = start;
    world.run(360);
    const Vec3& top = start.states.back().position_m;
    EXPECT_LT(most_sunk_m(world, start), 0.02 * top.z());
    for (const IslandReport& island : world.report.islands)
      EXPECT_LT(island.max_penetration_m, 0.01 * 2.0 * world.states[0].position_m.z());
  }
}

TEST(Structures, APebbleBringsNoWallDown) {
  World start = wall(24, 24, true);
  BodyState& pebble = start.add_body(start.add_shape(Sphere{0.02}), Vec3(3, -0.4, 0.96), 1500.0);
  pebble.linear_velocity_m_s = Vec3(0, 3, 0.5);
  World world = start;
  world.run(300);
  world.states.pop_back();
  EXPECT_LT(most_sunk_m(world, start), 0.01);
}

TEST(Structures, SubstepsGrowWithTheLoadOnWhatIsSmall) {
  const auto substeps = [](int boxes, double half_m, double mass_kg) {
    World world = test::under_gravity();
    world.scene.solver.direct = false;
    world.add_floor();
    const std::uint32_t box = world.add_shape(Box{Vec3::Constant(half_m)});
    const double density = mass_kg / std::pow(2.0 * half_m, 3);
    for (int i = 0; i < boxes; ++i) world.add_body(box, Vec3(0, 0, half_m * (2 * i + 1)), density);
    world.run(60);
    return substeps_under_load(
        {world.scene, world.scene.dt_s, world.ids, std::span<const BodyState>(world.states)});
  };
  EXPECT_EQ(substeps(1, 0.5, 1.0), 8u);
  EXPECT_EQ(substeps(8, 0.5, 1.0), 8u);
  EXPECT_EQ(substeps(8, 0.5, 1e4), 8u) << "masses do not matter";
  EXPECT_GT(substeps(8, 0.02, 1.0), 8u);
  EXPECT_GT(substeps(20, 0.1, 1.0), 8u);
  EXPECT_LE(substeps(20, 0.001, 1.0), 64u);
}

// The carrier's mass says nothing of what it carries.
TEST(Structures, WhatIsCarriedTakesAsManySubstepsAsOnAFloor) {
  World world = test::under_gravity();
  const std::uint32_t plate = world.add_shape(Box{Vec3(3, 3, 0.1)});
  world.add_body(plate, Vec3(0, 0, -0.1));
  world.scene.bodies[0].kinematic = true;
  world.scene.bodies[0].mass_kg = 1.0;
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 3; ++i) world.add_body(box, Vec3(0, 0, 0.5 + i));
  world.run(30);
  EXPECT_EQ(substeps_under_load({world.scene, world.scene.dt_s, world.ids,
                                 std::span<const BodyState>(world.states)}),
            8u);
}

// What resists rolling far away changes no bit of a stack.
TEST(Structures, RollingFrictionElsewhereChangesNothing) {
  const auto digest_of = [](double rolling_m) {
    World world = test::under_gravity();
    world.scene.solver.direct = false;
    world.add_floor();
    world.add_static(world.add_shape(Sphere{1.0}), Vec3(1000, 0, 0), Quat::Identity(),
                     {.friction = 0.5, .rolling_friction_m = rolling_m});
    const std::uint32_t box = world.add_shape(Box{Vec3::Constant(0.05)});
    for (int i = 0; i < 8; ++i) world.add_body(box, Vec3(0, 0, 0.05 + 0.1 * i));
    world.run(60);
    return world.digest_of_states();
  };
  EXPECT_EQ(digest_of(0.0), digest_of(0.01));
}

}  // namespace
}  // namespace soda::physics
