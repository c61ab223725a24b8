// What hits send on meets what comes next within the same step.
#include "physics/step/sent_on.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

constexpr double kRadius_m = 0.1, kDistance_m = 0.0075;

struct Row {
  int balls = 6;
  double gap_m = 0.0, speed_m_s = 1.0, restitution = 1.0;
  bool on_floor = false;
};

// A ball that comes to a row of others, all alike, with gaps between them.
World row_of(const Row& row) {
  World world;
  const Material smooth{.friction = 0.0, .restitution = row.restitution};
  world.scene.gravity_m_s2 = row.on_floor ? Vec3(0, 0, -kGravity) : Vec3(Vec3::Zero());
  world.scene.solver.restitution_threshold_m_s = 1e-9;
  if (row.on_floor) world.add_floor(smooth);
  const std::uint32_t ball = world.add_shape(Sphere{kRadius_m});
  for (int i = 0; i < row.balls; ++i) {
    const double x =
        i == 0 ? -2.0 * kRadius_m - kDistance_m : (2.0 * kRadius_m + row.gap_m) * (i - 1);
    world.add_body(ball, Vec3(x, 0, kRadius_m), 1000.0, smooth);
  }
  world.states[0].linear_velocity_m_s = Vec3(row.speed_m_s, 0, 0);
  return world;
}

// Places after a time, from hit to hit.
std::vector<double> exact_places(const Row& row, double time_s) {
  const std::size_t n = static_cast<std::size_t>(row.balls);
  std::vector<double> x(n), v(n, 0.0), gap(n, row.gap_m);
  for (std::size_t i = 0; i < n; ++i)
    x[i] = i == 0 ? -2.0 * kRadius_m - kDistance_m
                  : (2.0 * kRadius_m + row.gap_m) * static_cast<double>(i - 1);
  gap[0] = kDistance_m;
  v[0] = row.speed_m_s;
  for (double now_s = 0.0;;) {
    double next_s = time_s - now_s;
    std::size_t hit = n;
    for (std::size_t i = 0; i + 1 < n; ++i)
      if (v[i] - v[i + 1] > 1e-12 && gap[i] / (v[i] - v[i + 1]) < next_s) {
        next_s = gap[i] / (v[i] - v[i + 1]);
        hit = i;
      }
    for (std::size_t i = 0; i < n; ++i) x[i] += v[i] * next_s;
    for (std::size_t i = 0; i + 1 < n; ++i) gap[i] -= (v[i] - v[i + 1]) * next_s;
    now_s += next_s;
    if (hit == n) return x;
    gap[hit] = 0.0;
    const double change = 0.5 * (1.0 + row.restitution) * (v[hit] - v[hit + 1]);
    v[hit] -= change;
    v[hit + 1] += change;
  }
}

TEST(SentOn, ARowWithWideGapsIsHitBallAfterBallInOneStep) {
  for (const bool on_floor : {false, true})
    for (const double speed_m_s : {1.0, 3.0, 10.0})
      for (const double gap_m : {0.003, 0.01, 0.02, 0.05, 0.15})
        for (const int balls : {3, 6, 12}) {
          const Row row{balls, gap_m, speed_m_s, 1.0, on_floor};
          World world = row_of(row);
          const int steps = 3 + static_cast<int>((kDistance_m + gap_m * (balls - 2)) / speed_m_s /
                                                 world.scene.dt_s);
          world.run(steps);
          const std::vector<double> places = exact_places(row, steps * world.scene.dt_s);
          for (std::size_t i = 0; i < places.size(); ++i)
            EXPECT_NEAR(world.states[i].position_m.x(), places[i], 1e-8)
                << balls << " balls, gaps of " << gap_m << " m, " << speed_m_s << " m/s, floor "
                << on_floor << ", ball " << i;
        }
}

TEST(SentOn, WhatDoesNotBounceIsHitInOneStepToo) {
  for (const double restitution : {0.0, 0.5})
    for (const double gap_m : {0.01, 0.02, 0.05}) {
      const Row row{6, gap_m, 10.0, restitution, false};
      World world = row_of(row);
      world.run(4);
      const std::vector<double> places = exact_places(row, 4 * world.scene.dt_s);
      for (std::size_t i = 0; i < places.size(); ++i)
        EXPECT_NEAR(world.states[i].position_m.x(), places[i], 1e-8)
            << "gaps of " << gap_m << " m, restitution " << restitution << ", ball " << i;
    }
}

// The second ball is slowed down inside the box that it was looked at in: no smaller box tells.
TEST(SentOn, WhoIsSlowedDownIsRunInto) {
  World world;
  world.scene.gravity_m_s2 = Vec3::Zero();
  const Material springy{.friction = 0.0, .restitution = 1.0};
  const std::uint32_t ball = world.add_shape(Sphere{kRadius_m});
  const double speed_m_s[] = {6.0, 6.0, 0.0};
  const double at_m[] = {-0.48, -0.25, 0.0};
  for (int i = 0; i < 3; ++i)
    world.add_body(ball, Vec3(at_m[i], 0, 0), 1000.0, springy).linear_velocity_m_s =
        Vec3(speed_m_s[i], 0, 0);
  world.run(1);
  // The second stops after .05 m; the first comes to it after .08 m of .1 m, and stops in turn.
  EXPECT_GT(world.counters.islands_again, 0u);
  EXPECT_NEAR(world.states[2].linear_velocity_m_s.x(), 6.0, 1e-9);
  EXPECT_NEAR(world.states[1].linear_velocity_m_s.x(), 6.0, 1e-9);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), 0.0, 1e-9);
  EXPECT_NEAR(world.states[0].position_m.x(), -0.4, 1e-9);
  EXPECT_NEAR(world.states[1].position_m.x(), -0.18, 1e-9);
}

TEST(SentOn, NoPassIsTakenWhereNobodyComesToAnybodyNew) {
  World world;
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{Vec3(0.1, 0.1, 0.1)});
  for (int i = 0; i < 12; ++i) world.add_body(box, Vec3(0.5 * (i / 4), 0, 0.1 + 0.2 * (i % 4)));
  world.run(60);
  EXPECT_EQ(world.counters.islands_again, 0u);
  EXPECT_EQ(world.counters.sent_searches, 0u);
}

TEST(SentOn, BodiesOfGroupsThatDoNotTouchAreNotConnected) {
  const Row row{6, 0.02, 3.0, 1.0, false};
  World world = row_of(row);
  for (std::size_t i = 0; i < world.scene.bodies.size(); ++i) {
    world.scene.bodies[i].filter.groups = i < 2 ? 1 : 2;
    world.scene.bodies[i].filter.ignored_groups = i < 2 ? 2 : 0;
  }
  world.run(5);
  EXPECT_EQ(world.counters.islands_again, 0u);
  EXPECT_EQ(world.states[2].linear_velocity_m_s.x(), 0.0);
}

}  // namespace
}  // namespace soda::physics
