// Single bodies that are refined without a tolerance, where there is no limit to be found.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::under_gravity;
using test::World;

// What friction has more than one answer for, and what falls flat: a limit is looked for in a
// bounded number of solves, also where there is none.
TEST(UnaskedRefinement, ARodThatHasNoLimitTakesBoundedSteps) {
  constexpr Material kRough{.friction = 2.0, .restitution = 0.0};
  for (const double lean : {0.3, 0.52, 0.8}) {
    World world = under_gravity();
    world.add_floor(kRough);
    const Quat tilt = test::about(Vec3::UnitY(), -lean);
    const Vec3 half(0.5, 0.01, 0.01);
    const double low = half.x() * std::sin(lean) + half.z() * std::cos(lean);
    BodyState& rod = world.add_body(world.add_shape(Box{half}), Vec3(0, 0, low), 1000.0, kRough);
    rod.orientation = tilt;
    rod.linear_velocity_m_s = Vec3(-5, 0, 0);
    std::uint64_t most = 0;
    const Geometry geometry(world.scene);
    for (int i = 0; i < 120; ++i) {
      const std::uint64_t before = world.counters.refined_steps;
      world.run(1, geometry);
      most = std::max(most, world.counters.refined_steps - before);
    }
    EXPECT_GT(most, 0u) << lean;
    EXPECT_LE(most, 100u) << lean;                          // 220 with up to 64 solves
    EXPECT_LT(world.counters.refined_steps, 800u) << lean;  // of 120; 1950 with up to 64 solves
    EXPECT_LT(world.states[0].linear_velocity_m_s.norm(), 1e-3) << lean;
  }
}

// Boxes on each other that slide together, with four contact points each.
World sliding_stack(int count) {
  constexpr Material kRough{.friction = 0.5, .restitution = 0.0};
  World world = under_gravity();
  world.add_floor(kRough);
  const std::uint32_t box = world.add_shape(Box{Vec3(0.5, 0.5, 0.05)});
  for (int i = 0; i < count; ++i)
    world.add_body(box, Vec3(0, 0, 0.05 + 0.1 * i), 1000.0, kRough).linear_velocity_m_s =
        Vec3(1, 0, 0);
  return world;
}

TEST(UnaskedRefinement, TellsOfIslandsThatAreMoreWorkThanAStepMayTake) {
  World within = sliding_stack(8), beyond = sliding_stack(130);
  within.run(1);
  EXPECT_GT(within.counters.refined_steps, 0u);
  EXPECT_EQ(within.counters.islands_over_budget, 0u);
  beyond.run(1);
  EXPECT_GE(beyond.counters.contact_points, 4u * 130u);
  EXPECT_EQ(beyond.counters.islands_over_budget, 1u);
}

// However many hits divide a step, trials are made for one part of it at most, and not after each.
TEST(UnaskedRefinement, HitsDoNotMultiplyTrials) {
  constexpr int kReversals = 2, kTrials = 1 + 2 + 4 + 8 + 16, kBalls = 8;
  constexpr Material kBouncy{.friction = 0.0, .restitution = 0.9};
  constexpr double kSpeed_m_s = 5.0, kRadius_m = 0.02, kTop_m = 0.3;
  World world = sliding_stack(3);
  const std::uint32_t ball = world.add_shape(Sphere{kRadius_m});
  for (int i = 0; i < kBalls; ++i) {
    const double gap_m = kSpeed_m_s * world.scene.dt_s * (i + 0.5) / kBalls;
    world
        .add_body(ball, Vec3(-0.35 + 0.1 * i, 0.1 * (i % 3), kTop_m + kRadius_m + gap_m), 1000.0,
                  kBouncy)
        .linear_velocity_m_s = Vec3(0, 0, -kSpeed_m_s);
  }
  world.run(1);
  EXPECT_GE(world.counters.impacts, static_cast<std::uint64_t>(kBalls));
  EXPECT_LE(world.counters.refined_steps, static_cast<std::uint64_t>(1 + kReversals + kTrials));
}

// Plates on each other stop as one: a plain step that throws them is no hit.
TEST(UnaskedRefinement, PlatesSlideAsOneForAnyNumber) {
  constexpr double kPlate_m = 0.02, kFriction = 0.2;
  const Material rough{.friction = 4.0 * kFriction, .restitution = 0.0};
  const auto off_m_s = [&](int count, double ratio, int steps) {
    World world = under_gravity();
    world.add_floor({.friction = kFriction * kFriction / rough.friction, .restitution = 0.0});
    const std::uint32_t plate = world.add_shape(Box{Vec3(0.5, 0.5, 0.5 * kPlate_m)});
    for (int i = 0; i < count; ++i)
      world
          .add_body(plate, Vec3(0, 0, (0.5 + i) * kPlate_m),
                    1000.0 * std::pow(ratio, i / (count - 1.0)), rough)
          .linear_velocity_m_s = Vec3(3, 0, 0);
    world.run(steps);
    const double right = 3.0 - kFriction * test::kGravity * steps * world.scene.dt_s;
    double off = 0.0;
    for (const BodyState& state : world.states)
      off = std::max(off, (state.linear_velocity_m_s - Vec3(right, 0, 0)).norm());
    return off;
  };
  for (const int count : {2, 8, 31, 32, 33, 40, 63, 64, 65, 90})
    EXPECT_LE(off_m_s(count, 1.0, 20), 1e-6) << count;
  for (const int count : {2, 8, 25, 32, 40, 64})
    EXPECT_LE(off_m_s(count, 100.0, 10), 1e-6) << count;
}

}  // namespace
}  // namespace soda::physics
