// Hits of what rests, rolls or slides.
#include "physics/events/contact_impacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <random>

#include "physics/forces/forces.hpp"
#include "physics/step/advance_island.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::under_gravity;
using test::World;

constexpr double kTolerances[] = {0.0, 1e-6};  // 0: none asked for

World on_floor(double dt_s, double tolerance, Material material) {
  World world = under_gravity();
  world.scene.dt_s = dt_s;
  world.scene.tolerance = tolerance;
  world.add_floor(material);
  return world;
}

void add_wall(World& world, double x_m, Material material) {
  world.add_static(world.add_shape(HalfSpace{Vec3(-1, 0, 0), -x_m}), Vec3::Zero(), Quat::Identity(),
                   material);
}

void run_for(World& world, double time_s) {
  world.run(static_cast<int>(std::lround(time_s / world.scene.dt_s)));
}

// It brakes, bounces back with half of its speed, and stops.
TEST(ContactImpacts, ABoxThatSlidesIntoAWallBouncesWhereAndWhenItGetsThere) {
  constexpr double kSpeed = 4.0, kDistance = 0.7;
  const Material material{.friction = 0.3, .restitution = 0.5};
  const double slowing = 0.3 * kGravity;
  const double back = 0.25 * (kSpeed * kSpeed - 2.0 * slowing * kDistance) / (2.0 * slowing);
  for (const double tolerance : kTolerances) {
    for (const double dt : {1.0 / 10, 1.0 / 60, 1.0 / 77, 1.0 / 480}) {
      World world = on_floor(dt, tolerance, material);
      add_wall(world, 0.5 + kDistance, material);
      world.add_body(world.add_shape(Box{}), Vec3(0, 0, 0.5), 1000.0, material)
          .linear_velocity_m_s = Vec3(kSpeed, 0, 0);
      run_for(world, 2.0);
      EXPECT_NEAR(world.states[0].position_m.x(), kDistance - back, 1e-8) << dt << " " << tolerance;
      EXPECT_EQ(world.counters.impacts, 1u);
    }
  }
}

// One step of the first box more or less, 5 cm, is what it was off by; with a tolerance, the hit of
// one edge of the face after the other threw both up.
TEST(ContactImpacts, BoxesOnASmoothFloorHitWithTheirFacesWheneverInTheStep) {
  constexpr double kSpeed = 3.0;
  for (const double tolerance : kTolerances) {
    for (const double restitution : {0.0, 0.5, 1.0}) {
      if (restitution == 0.0 && tolerance == 0.0) continue;  // is not looked at
      for (const double gap_m : {1.0, 0.98, 0.963}) {
        const Material material{.friction = 0.0, .restitution = restitution};
        World world = on_floor(1.0 / 60, tolerance, material);
        const std::uint32_t box = world.add_shape(Box{});
        world.add_body(box, Vec3(0, 0, 0.5), 1000.0, material).linear_velocity_m_s =
            Vec3(kSpeed, 0, 0);
        world.add_body(box, Vec3(1.0 + gap_m, 0, 0.5), 1000.0, material);
        run_for(world, 2.0);
        const double left_s = 2.0 - gap_m / kSpeed;
        const double first = 0.5 * (1.0 - restitution) * kSpeed;
        EXPECT_NEAR(world.states[0].position_m.x(), gap_m + first * left_s, 2e-8);
        EXPECT_NEAR(world.states[1].position_m.x(), 1.0 + gap_m + (kSpeed - first) * left_s, 2e-8);
        for (const BodyState& state : world.states) {
          EXPECT_NEAR(state.position_m.z(), 0.5, 1e-8);
          EXPECT_LT(state.angular_velocity_rad_s.norm(), 1e-8);
        }
      }
    }
  }
}

// Its ends come nearer along other lines than that on which it is nearest at first.
TEST(ContactImpacts, WhereARodThatSpinsOnAFloorHitsDoesNotDependOnTheStep) {
  const Material material{.friction = 0.0, .restitution = 1.0};
  std::vector<Vec3> ends;
  for (const double dt : {1.0 / 1920, 1.0 / 240, 1.0 / 60, 1.0 / 40}) {
    World world = on_floor(dt, 0.0, material);
    const Quat lying = test::about(Vec3::UnitY(), 0.5 * 3.14159265358979);
    BodyState& rod = world.add_body(world.add_shape(Capsule{.radius_m = 0.05, .length_m = 0.9}),
                                    Vec3(0, 0, 0.05), 1000.0, material);
    rod.orientation = lying;
    rod.angular_velocity_rad_s = Vec3(0, 0, 12);
    world.add_body(world.add_shape(Box{Vec3(0.05, 0.05, 0.05)}), Vec3(0.35, 0.3, 0.05), 1000.0,
                   material);
    const double before = world.mechanics().kinetic_energy_joule;
    run_for(world, 0.4);
    EXPECT_NEAR(world.mechanics().kinetic_energy_joule / before, 1.0, 1e-6);
    ends.push_back(world.states[1].position_m);
    EXPECT_GT((ends[0] - Vec3(0.35, 0.3, 0.05)).norm(), 0.5);
    EXPECT_LT((ends.back() - ends[0]).norm(), 2e-6) << dt;
  }
}

// By turning, what rolls shows nothing new, nor does what spins where it stands.
TEST(ContactImpacts, WhatRollsOrSpinsAboutTheNormalIsNotLookedAtAgain) {
  const Material material{.friction = 0.5, .restitution = 0.3};
  const Quat lying = test::about(Vec3::UnitX(), 0.5 * 3.14159265358979);
  for (const double angular_speed_rad_s : {3.0, 30.0, 100.0}) {
    World world = on_floor(1.0 / 60, 0.0, material);
    BodyState& rolls = world.add_body(world.add_shape(Capsule{.radius_m = 0.1, .length_m = 0.3}),
                                      Vec3(0, 0, 0.1), 800.0, material);
    rolls.orientation = lying;
    rolls.linear_velocity_m_s = Vec3(0.1 * angular_speed_rad_s, 0, 0);
    rolls.angular_velocity_rad_s = Vec3(0, angular_speed_rad_s, 0);
    world.add_body(world.add_shape(Box{Vec3(0.1, 0.1, 0.05)}), Vec3(0, 9, 0.05), 800.0, material)
        .angular_velocity_rad_s = Vec3(0, 0, angular_speed_rad_s);
    run_for(world, 1.0);
    EXPECT_EQ(world.counters.hit_searches, 0u) << angular_speed_rad_s;
    EXPECT_NEAR(world.states[0].position_m.x(), 0.1 * angular_speed_rad_s,
                1e-3 * angular_speed_rad_s);
  }
}

// All at once, four would go on together.
TEST(ContactImpacts, BallsThatTouchOnAFloorPassAMomentumOn) {
  const Material material{.friction = 0.0, .restitution = 1.0};
  World world = on_floor(1.0 / 60, 0.0, material);
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_body(ball, Vec3(-0.51, 0, 0.1), 1000.0, material).linear_velocity_m_s = Vec3(1, 0, 0);
  for (int i = 0; i < 4; ++i) world.add_body(ball, Vec3(0.2 * i, 0, 0.1), 1000.0, material);
  run_for(world, 0.5);
  for (int i = 0; i < 4; ++i) EXPECT_LT(world.states[i].linear_velocity_m_s.norm(), 1e-12) << i;
  EXPECT_NEAR(world.states[4].linear_velocity_m_s.x(), 1.0, 1e-12);
  EXPECT_NEAR(world.states[4].position_m.x(), 0.6 + 0.5 - 0.31, 1e-9);
}

TEST(ContactImpacts, WhatIsHitAtOneTimeIsHitAtOnce) {
  const Material material{.friction = 0.0, .restitution = 1.0};
  World world = on_floor(1.0 / 60, 0.0, material);
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_body(ball, Vec3(-0.4, 0, 0.1), 1000.0, material).linear_velocity_m_s = Vec3(2, 0, 0);
  world.add_body(ball, Vec3(0.1 * std::sqrt(3.0), 0.1, 0.1), 1000.0, material);
  world.add_body(ball, Vec3(0.1 * std::sqrt(3.0), -0.1, 0.1), 1000.0, material);
  run_for(world, 0.5);
  // Equal impulses P along 30 degrees: m (2 - v) = sqrt(3) P, energy: v = -2/5.
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), -0.4, 1e-8);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.y(), 0.0, 1e-8);
  const Vec3 away = world.states[1].linear_velocity_m_s;
  EXPECT_NEAR(away.x(), 1.2, 1e-8);
  EXPECT_NEAR(away.y(), 1.2 / std::sqrt(3.0), 1e-8);
  EXPECT_NEAR(world.states[2].linear_velocity_m_s.y(), -away.y(), 1e-8);
}

// Before, two fifths of it were gone by then: contacts that were one more step of the solver away
// slowed what came for a bounce. What is left are impacts below the threshold.
TEST(ContactImpacts, BallsOnATableKeepTheirEnergy) {
  const Material material{.friction = 0.0, .restitution = 1.0};
  World world = on_floor(1.0 / 60, 0.0, material);
  for (int wall = 0; wall < 4; ++wall)
    world.add_static(
        world.add_shape(HalfSpace{
            test::about(Vec3::UnitZ(), 0.5 * 3.14159265358979 * wall) * Vec3::UnitX(), -1.0}),
        Vec3::Zero(), Quat::Identity(), material);
  const std::uint32_t ball = world.add_shape(Sphere{0.2});
  std::mt19937 random(7);
  std::uniform_real_distribution<double> speed(-2.0, 2.0);
  for (int i = 0; i < 16; ++i)
    world.add_body(ball, Vec3(-0.7 + 0.45 * (i % 4), -0.7 + 0.45 * (i / 4), 0.2), 1000.0, material)
        .linear_velocity_m_s = Vec3(speed(random), speed(random), 0);
  const double before = world.mechanics().kinetic_energy_joule;
  run_for(world, 10.0);
  EXPECT_GT(world.counters.impacts, 1000u);
  const double left = world.mechanics().kinetic_energy_joule / before;
  EXPECT_NEAR(left, 1.0, 1e-3);
  std::printf("%.3g of the energy lost\n", 1.0 - left);
}

// Flight through impacts is not for meshes.
TEST(ContactImpacts, ABallBouncesOnAMeshAsHighAsItShould) {
  const Material material{.friction = 0.5, .restitution = 0.8};
  TriangleMesh mesh;
  mesh.vertices_m = {Vec3(-3, -3, 0), Vec3(3, -3, 0), Vec3(0, 4, 0)};
  mesh.triangles = {{0, 1, 2}};
  World world = under_gravity();
  world.add_static(world.add_shape(mesh), Vec3::Zero(), Quat::Identity(), material);
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, 1.1), 1000.0, material);
  const double fall_s = std::sqrt(2.0 / kGravity);
  world.run(static_cast<int>(fall_s * 1.8 / world.scene.dt_s));
  const double since_s = world.scene.dt_s * std::floor(fall_s * 1.8 / world.scene.dt_s) - fall_s;
  EXPECT_NEAR(world.states[0].position_m.z(),
              0.1 + 0.8 * kGravity * fall_s * since_s - 0.5 * kGravity * since_s * since_s, 1e-7);
}

// With air that brakes them, and a wind. Flight through impacts is not for what is pushed.
TEST(ContactImpacts, WhatIsPushedAndDampedBouncesWhereverInTheStep) {
  const Material material{.friction = 0.2, .restitution = 0.7};
  std::vector<BodyState> ends;
  for (const double dt : {1.0 / 3840, 1.0 / 240, 1.0 / 60, 1.0 / 50}) {
    World world = on_floor(dt, 0.0, material);
    world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, 0.6), 1000.0, material);
    BodyParams& ball = world.scene.bodies[0];
    ball.forces = 0;
    world.scene.forces.push_back({.linear_damping_1_s = 0.4});
    ball.own_field_m_s2 = Vec3(1.5 / ball.mass_kg, 0, 0);
    const double fall_s = 0.6;  // after the first bounce
    Vec3 momentum = world.mechanics().linear_momentum_newton_s;
    const Geometry geometry(world.scene);
    for (int step = 0; step < std::lround(fall_s / dt); ++step) {
      const std::vector<BodyState> before = world.states;
      world.run(1, geometry);
      momentum += push_impulse_newton_s(world.scene, dt, BodyId{0}, before[0]) +
                  ball.mass_kg * dt * field_of(world.scene, ball);
      for (const IslandReport& island : world.report.islands)
        momentum += island.static_impulse_newton_s;
    }
    EXPECT_EQ(world.counters.impacts, 1u);
    EXPECT_LT((world.mechanics().linear_momentum_newton_s - momentum).norm(), 1e-12);
    ends.push_back(world.states[0]);
    EXPECT_LT((ends.back().position_m - ends[0].position_m).norm(), 1e-7) << dt;
    EXPECT_LT((ends.back().linear_velocity_m_s - ends[0].linear_velocity_m_s).norm(), 1e-6) << dt;
  }
  EXPECT_GT(ends[0].position_m.z(), 0.2);
}

TEST(ContactImpacts, NothingIsLookedForWhereNothingBounces) {
  World world = under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  world.add_body(box, Vec3(0, 0, 0.5)).linear_velocity_m_s = Vec3(6, 0, 0);
  world.add_body(box, Vec3(1.5, 0, 0.5));
  run_for(world, 1.0);
  EXPECT_EQ(world.counters.impacts, 0u);
  EXPECT_GT(world.states[1].position_m.x(), 1.6);
}

// Work is counted where it is done: the hits of an island take no more than a step has for them,
// and what is left of the step is one solve of all that is near. Without either, 16 boxes took 20
// million iterations over a row, and sank into each other by a tenth.
TEST(ContactImpacts, HitsTakeNoMoreWorkThanAStepHas) {
  for (const int number : {4, 9, 16, 25}) {
    const Material material{.friction = 0.5, .restitution = 0.2};
    World world = on_floor(1.0 / 60, 0.0, material);
    const std::uint32_t box = world.add_shape(Box{Vec3(0.5, 0.5, 0.5)});
    for (int i = 0; i < number; ++i)
      world.add_body(box, Vec3(0.02 * (i % 3), 0.03 * (i % 2), 0.6 + 1.05 * i), 500.0, material)
          .linear_velocity_m_s = Vec3(0, 0, -7.0);
    std::uint64_t most = 0;
    double deepest_m = 0.0;
    const Geometry geometry(world.scene);
    for (int step = 0; step < 60; ++step) {
      const StageCounters before = world.counters;
      world.run(1, geometry);
      const std::uint64_t rows = world.counters.row_sweeps - before.row_sweeps,
                          factors =
                              world.counters.factor_multiplications - before.factor_multiplications;
      most = std::max(most, rows + factors / 16);
      for (const IslandReport& island : world.report.islands)
        deepest_m = std::max(deepest_m, island.max_penetration_m);
    }
    EXPECT_LE(most, 12u * (20'000u + 1000u * static_cast<unsigned>(number))) << number;
    EXPECT_LE(deepest_m, 0.04) << number;
  }
}

// Worlds that know different things put contacts together that no one state has: what hits leave
// has no part of a body that is not there.
TEST(ContactImpacts, TakeContactsOfABodyThatIsElsewhere) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    const auto vector = [&] { return Vec3(any(random), any(random), any(random)); };
    World world;
    const std::uint32_t box = world.add_shape(Box{Vec3(0.15, 0.15, 0.15)});
    for (int i = 0; i < 8; ++i) {
      const Vec3 at(0.3 * (i % 2), 0.3 * (i / 2 % 2), 0.3 * (i / 4));
      BodyState& body = world.add_body(box, at + 0.03 * vector(), 500.0, {.restitution = 0.8});
      body.linear_velocity_m_s = 8.0 * vector();
    }
    std::vector<ContactManifold> found;
    for (const BodyId a : world.ids)
      for (const BodyId b : world.ids)
        if (a < b) std::ranges::copy(test::contacts_of(world, a, b), std::back_inserter(found));
    world.states.back().position_m.x() += 1.5;
    const Geometry geometry(world.scene);
    std::vector<AdvanceFault> faults;
    EXPECT_NO_THROW(advance_island(whole_step(world.scene, geometry, world.ids, found),
                                   world.states, {world.scratch.solve, world.counters, faults}))
        << seed;
  }
}

}  // namespace
}  // namespace soda::physics
