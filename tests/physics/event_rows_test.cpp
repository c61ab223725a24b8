// Rows of bodies: one law for any number of them.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::under_gravity;
using test::World;

constexpr int kNumbers[] = {2, 8, 9, 16, 64, 65, 100};

// A ball comes at 1 m/s to a row of others; in flight, or on a smooth floor.
World row_of_balls(int number, double gap_m, double restitution, bool on_floor) {
  const Material material{.friction = 0.0, .restitution = restitution};
  World world;
  if (on_floor) {
    world = under_gravity();
    world.add_floor(material);
  }
  world.scene.dt_s = 1.0 / 60;
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_body(ball, Vec3(-0.2075, 0, 0.1), 1000.0, material).linear_velocity_m_s = Vec3(1, 0, 0);
  for (int i = 0; i + 1 < number; ++i)
    world.add_body(ball, Vec3((0.2 + gap_m) * i, 0, 0.1), 1000.0, material);
  return world;
}

// 9 on a floor: the last one had -.771; 65 in flight lost 26.6 % of the energy.
TEST(EventRows, AMomentumPassesThroughAnyNumberOfElasticBalls) {
  for (const bool on_floor : {false, true}) {
    for (const double gap_m : {0.0, 0.0015}) {
      for (const int number : kNumbers) {
        World world = row_of_balls(number, gap_m, 1.0, on_floor);
        world.run(2 + static_cast<int>(std::ceil(60.0 * (0.0075 + gap_m * number))));
        EXPECT_NEAR(world.states.back().linear_velocity_m_s.x(), 1.0, 1e-12) << number;
        for (int i = 0; i + 1 < number; ++i)
          ASSERT_LT(world.states[i].linear_velocity_m_s.norm(), 1e-12) << number << " " << i;
        EXPECT_EQ(world.counters.impacts, static_cast<std::uint64_t>(number - 1));
      }
    }
  }
}

TEST(EventRows, BallsThatBounceLessKeepTheirMomentumAndGainNothing) {
  for (const bool on_floor : {false, true}) {
    for (const double restitution : {0.5, 0.0}) {
      for (const int number : kNumbers) {
        World world = row_of_balls(number, 0.0, restitution, on_floor);
        const double before = world.mechanics().kinetic_energy_joule;
        world.run(2);
        double momentum = 0.0, last = 2.0;
        for (const BodyState& state : world.states) {
          momentum += state.linear_velocity_m_s.x();
          EXPECT_GT(state.linear_velocity_m_s.x(), -1e-9);
          last = state.linear_velocity_m_s.x();
        }
        EXPECT_NEAR(momentum, 1.0, 1e-12) << number;
        if (number == 2) {
          EXPECT_NEAR(last, 0.5 * (1.0 + restitution), 1e-9);
        }
        EXPECT_LT(world.mechanics().kinetic_energy_joule, before);
      }
    }
  }
}

// 10 on a floor were .04 m/s off: those nearer than 1e-4 of a width were hit at once, and there was
// work for some of the hits only. Later, where hits of a row have no end, the two differ.
TEST(EventRows, BallsThatBounceLessHitOneAnotherOnAFloorAsInFlight) {
  for (const int number : {2, 8, 9, 10, 12, 25, 64}) {
    std::vector<BodyState> ends[2];
    for (const bool on_floor : {false, true}) {
      World world = row_of_balls(number, 0.0015, 0.5, on_floor);
      world.scene.solver.restitution_threshold_m_s = 1e-9;
      world.run(5);
      ends[on_floor] = world.states;
    }
    for (int i = 0; i < number; ++i)
      EXPECT_NEAR(ends[0][i].linear_velocity_m_s.x(), ends[1][i].linear_velocity_m_s.x(), 1e-9)
          << number << " " << i;
  }
}

// Side by side, which holds nothing: each stops where it does alone. 9 were 5 cm off, 8 were not.
TEST(EventRows, BoxesThatSlideSideBySideStopWhereEachDoesAlone) {
  constexpr double kSpeed = 3.0, kFriction = 0.3;
  const Material material{.friction = kFriction};
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    for (const double push_newton : {0.0, 1e-12}) {
      for (const int number : {1, 2, 8, 9, 16, 64, 65, 100}) {
        World world = under_gravity();
        world.scene.dt_s = dt;
        world.add_floor(material);
        const std::uint32_t box = world.add_shape(Box{});
        for (int i = 0; i < number; ++i)
          world.add_body(box, Vec3(0, i, 0.5), 1000.0, material).linear_velocity_m_s =
              Vec3(kSpeed, 0, 0);
        for (BodyParams& body : world.scene.bodies)
          body.own_field_m_s2 = Vec3(push_newton / body.mass_kg, 0, 0);
        world.run(2 + static_cast<int>(kSpeed / (kFriction * kGravity) / dt));
        for (const BodyState& state : world.states) {
          ASSERT_NEAR(state.position_m.x(), 0.5 * kSpeed * kSpeed / (kFriction * kGravity), 1e-11)
              << number << " " << push_newton << " " << dt;
          ASSERT_LT(state.linear_velocity_m_s.norm(), 1e-10);
        }
      }
    }
  }
}

// What else is in the island has no part in a hit: the same bits with and without a row beside.
TEST(EventRows, AHitDoesNotDependOnWhatElseTouches) {
  std::vector<BodyState> first;
  for (const int more : {0, 1, 20}) {
    World world = row_of_balls(3, 0.001, 0.5, true);
    const std::uint32_t ball = 1;
    for (int i = 0; i < more; ++i)
      world.add_body(ball, Vec3(0.4 + 0.001 + 0.2 * i, 0.3, 0.1), 1000.0,
                     Material{.friction = 0.0, .restitution = 0.5});
    world.run(6);
    if (more == 0) first = world.states;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_LT((world.states[i].linear_velocity_m_s - first[i].linear_velocity_m_s).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace soda::physics
