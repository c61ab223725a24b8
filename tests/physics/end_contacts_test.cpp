// Contacts that come round within a step: what turns must not sink in.
#include "physics/integrators/end_contacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

double deepest_m(const World& world) {
  double deepest = 0.0;
  for (const IslandReport& island : world.report.islands)
    deepest = std::max(deepest, island.max_penetration_m);
  return deepest;
}

Vec3 random_axis(std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  const double x = normal(engine), y = normal(engine), z = normal(engine);
  return Vec3(x, y, z).normalized();
}

struct Sinking {
  double mean = 0.0, most = 0.0;  // of the width: of the deepest of each step
};

Sinking run_and_measure(World& world, double width_m, int steps) {
  const Geometry geometry(world.scene);
  Sinking sinking;
  for (int i = 0; i < steps; ++i) {
    world.run(1, geometry);
    sinking.mean += deepest_m(world) / (steps * width_m);
    sinking.most = std::max(sinking.most, deepest_m(world) / width_m);
  }
  return sinking;
}

// Ten of a kind, far from each other, that fall on a floor and turn.
Sinking sinking_of(const Shape& shape, double width_m, double angular_speed_rad_s,
                   double restitution) {
  constexpr int kBodies = 10, kSteps = 180;
  World world = test::under_gravity();
  const Material material{.friction = 0.5, .restitution = restitution};
  world.add_floor(material);
  const std::uint32_t kind = world.add_shape(shape);
  std::mt19937_64 engine(11);
  for (int i = 0; i < kBodies; ++i) {
    BodyState& state = world.add_body(kind, Vec3(i, 0.0, 0.4), 1000.0, material);
    state.angular_velocity_rad_s = random_axis(engine) * angular_speed_rad_s;
    state.linear_velocity_m_s = Vec3(0.3, 0.0, 0.0);
  }
  return run_and_measure(world, width_m, kSteps);
}

TEST(EndContacts, CoinsPlatesAndDrumsThatTurnDoNotSinkIn) {
  const struct {
    const char* name;
    Shape shape;
    double width_m;
  } kinds[] = {{"coin", Cylinder{.radius_m = 0.06, .length_m = 0.012}, 0.012},
               {"plate", Box{Vec3(0.1, 0.075, 0.005)}, 0.01},
               {"drum", Cylinder{.radius_m = 0.05, .length_m = 0.1}, 0.1},
               {"die", Box{Vec3(0.04, 0.04, 0.04)}, 0.08},
               {"rod", Capsule{.radius_m = 0.03, .length_m = 0.15}, 0.06}};
  for (const auto& kind : kinds)
    for (const double restitution : {0.0, 0.3})
      for (const double angular_speed_rad_s : {2.0, 5.0, 10.0, 20.0, 40.0, 60.0}) {
        const Sinking found =
            sinking_of(kind.shape, kind.width_m, angular_speed_rad_s, restitution);
        EXPECT_LE(found.mean, 0.01)
            << kind.name << " " << restitution << " " << angular_speed_rad_s;
        EXPECT_LE(found.most, 0.25)
            << kind.name << " " << restitution << " " << angular_speed_rad_s;
      }
}

// Three blocks a layer, across those below; a beam is thrown at it.
TEST(EndContacts, ATowerThatIsHitDoesNotSinkIntoItself) {
  constexpr int kSteps = 150;
  constexpr double kHeight_m = 0.15;
  for (const int layers : {6, 12, 18, 24}) {
    World world = test::under_gravity();
    world.add_floor();
    const std::uint32_t block = world.add_shape(Box{Vec3(0.125, 0.375, 0.5 * kHeight_m)});
    for (int layer = 0; layer < layers; ++layer)
      for (int i = -1; i < 2; ++i) {
        const bool across = layer % 2 == 1;
        const double z_m = (0.5 + layer) * kHeight_m;
        BodyState& state =
            world.add_body(block, across ? Vec3(0, 0.26 * i, z_m) : Vec3(0.26 * i, 0, z_m), 200.0);
        if (across) state.orientation = test::about(Vec3::UnitZ(), 0.5 * 3.14159265358979323846);
      }
    BodyState& beam = world.add_body(world.add_shape(Box{Vec3(0.025, 0.3, 0.025)}),
                                     Vec3(0, -1.2, 0.5 * layers * kHeight_m), 700.0);
    beam.linear_velocity_m_s = Vec3(0, 1.5, 1.2);
    const Geometry geometry(world.scene);
    double mean = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      world.run(1, geometry);
      mean += deepest_m(world) / (kSteps * kHeight_m);
    }
    EXPECT_LE(mean, 0.0025) << layers << " layers";
  }
}

// Thin things that were thrown onto each other have sunk in. Factorising them at any price took a
// hundred times what substeps take.
TEST(EndContacts, HeapsOfCoinsAreSolvedByLittleWork) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / 60.0;
  world.add_floor(Material{.friction = 0.3});
  const std::uint32_t coin = world.add_shape(Cylinder{.radius_m = 0.012, .length_m = 0.002});
  std::mt19937_64 engine(3);
  constexpr int kCoins = 60, kSteps = 60;
  for (int i = 0; i < kCoins; ++i) {
    const Vec3 aside = 0.01 * random_axis(engine);
    BodyState& state = world.add_body(coin, Vec3(aside.x(), aside.y(), 0.05 + 0.03 * i), 8000.0,
                                      Material{.friction = 0.3});
    state.orientation = test::about(random_axis(engine), 0.5);
  }
  world.run(kSteps);
  EXPECT_LT(static_cast<double>(world.counters.factor_multiplications), 8e7 * kSteps);
}

TEST(EndContacts, AreNotLookedForWhereNothingShowsOtherPoints) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t ball = world.add_shape(Sphere{0.1}), box = world.add_shape(Box{});
  for (int i = 0; i < 20; ++i) world.add_body(ball, Vec3(0.05 * (i % 2), 0, 0.2 + 0.25 * i));
  for (int i = 0; i < 5; ++i) world.add_body(box, Vec3(5, 0, 0.5 + i));
  world.run(120);
  EXPECT_GT(world.counters.islands_solved, 100u);
  EXPECT_EQ(world.counters.turned_searches, 0u);
}

// Many of a kind that are poured into a funnel: hits throw some of them onto others, whom they were
// not on their way to.
Sinking pouring(const Shape& shape, double width_m, int layers, double gravity) {
  constexpr int kAcross = 4, kSteps = 90;
  World world = test::under_gravity();
  world.scene.gravity_m_s2 *= gravity;
  const Material material{.friction = 0.5, .restitution = 0.0};
  world.add_floor(material);
  for (int wall = 0; wall < 4; ++wall) {
    const Quat turn = test::about(Vec3::UnitZ(), 0.5 * 3.14159265358979 * wall);
    world.add_static(
        world.add_shape(HalfSpace{turn * Vec3(1.0, 0.0, 1.0).normalized(), -2.0 * width_m}),
        Vec3::Zero(), Quat::Identity(), material);
  }
  const std::uint32_t kind = world.add_shape(shape);
  std::mt19937_64 engine(3);
  for (int i = 0; i < kAcross * kAcross * layers; ++i) {
    BodyState& state = world.add_body(
        kind,
        1.8 * width_m *
                Vec3(i % kAcross - 1.5, i / kAcross % kAcross - 1.5, i / (kAcross * kAcross)) +
            0.03 * width_m * random_axis(engine) + Vec3(0.0, 0.0, 1.0),
        1000.0, material);
    state.orientation = test::about(random_axis(engine), 0.1 * i);
    state.linear_velocity_m_s = Vec3(0.0, 0.0, -2.0);
  }
  return run_and_measure(world, width_m, kSteps);
}

// Small ones come three and a half widths far in a step. Which hits come about changes with the
// last digit of gravity: what counts is the mean of some runs, of how deep the deepest is as well.
TEST(EndContacts, WhatHitsThrowOntoOthersIsSolvedWithThem) {
  constexpr int kRuns = 6;
  const struct {
    const char* name;
    Shape shape;
    double width_m;
    int layers;
    double mean, most;
  } kinds[] = {{"balls", Sphere{0.1}, 0.2, 10, 0.015, 0.2},
               {"small balls", Sphere{0.01}, 0.02, 10, 0.11, 0.8},
               {"boxes", Box{Vec3(0.1, 0.1, 0.1)}, 0.2, 6, 0.02, 0.2},
               {"drums", Cylinder{0.1, 0.2}, 0.2, 6, 0.042, 0.3}};
  for (const auto& kind : kinds) {
    Sinking all;
    for (int run = 0; run < kRuns; ++run) {
      const Sinking found = pouring(kind.shape, kind.width_m, kind.layers, 1.0 + 0.003 * run);
      all.mean += found.mean / kRuns;
      all.most += found.most / kRuns;
    }
    EXPECT_LE(all.mean, kind.mean) << kind.name;
    EXPECT_LE(all.most, kind.most) << kind.name;
  }
}

}  // namespace
}  // namespace soda::physics
