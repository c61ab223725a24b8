// What comes to something that does not bounce is shared out to the last body that it reaches.
#include "physics/solvers/blows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/math/rigid_motion.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

constexpr double kRadius_m = 0.1, kDistance_m = 0.0075;

// A ball at 1 m/s comes to a row of n - 1; the last is as heavy as `ratio` times the first.
World ball_row(int n, double gap_m, double ratio, bool on_floor) {
  World world;
  const Material smooth{.friction = 0.0, .restitution = 0.0};
  world.scene.gravity_m_s2 = on_floor ? Vec3(0, 0, -kGravity) : Vec3(Vec3::Zero());
  if (on_floor) world.add_floor(smooth);
  const std::uint32_t ball = world.add_shape(Sphere{kRadius_m});
  for (int i = 0; i < n; ++i) {
    const double x = i == 0 ? -2.0 * kRadius_m - kDistance_m : (2.0 * kRadius_m + gap_m) * (i - 1);
    world.add_body(ball, Vec3(x, 0, kRadius_m), std::pow(ratio, i / (n - 1.0)), smooth);
  }
  world.states[0].linear_velocity_m_s = Vec3(1, 0, 0);
  return world;
}

double mass_of(const World& world) {
  double mass = 0.0;
  for (const BodyParams& body : world.scene.bodies) mass += body.mass_kg;
  return mass;
}

TEST(Blows, TouchingBallsGoOnTogetherForAnyNumber) {
  for (const bool on_floor : {false, true})
    for (const double ratio : {1.0, 0.02})
      for (const int n : {3, 4, 5, 8, 9, 16, 33, 64, 65, 120}) {
        World world = ball_row(n, 0.0, ratio, on_floor);
        const double together_m_s = world.scene.bodies[0].mass_kg / mass_of(world);
        world.run(3);
        double off = 0.0;
        for (const BodyState& state : world.states)
          off = std::max(off, (state.linear_velocity_m_s - Vec3(together_m_s, 0, 0)).norm());
        EXPECT_LE(off, 1e-8) << n << " balls, ratio " << ratio << ", floor " << on_floor;
      }
}

// Blow after blow, several in a step.
TEST(Blows, SpacedBallsAreTakenAlongOneAfterTheOther) {
  for (const bool on_floor : {false, true})
    for (const double dt_s : {1.0 / 30, 1.0 / 60, 1.0 / 240})
      for (const int n : {3, 7, 12, 20}) {
        constexpr double kGap_m = 0.0015;
        World world = ball_row(n, kGap_m, 1.0, on_floor);
        world.scene.dt_s = dt_s;
        double needed_s = kDistance_m;
        for (int i = 2; i < n; ++i) needed_s += kGap_m * i;
        world.run(static_cast<int>(needed_s / dt_s) + 2);
        double off = 0.0;
        for (const BodyState& state : world.states)
          off = std::max(off, (state.linear_velocity_m_s - Vec3(1.0 / n, 0, 0)).norm());
        EXPECT_LE(off, 1e-6) << n << " balls, step " << dt_s << ", floor " << on_floor;
        EXPECT_GT(world.counters.blows, 0u);
        EXPECT_EQ(world.counters.blows_left, 0u);
      }
}

// How fast balls of a row come nearer that touch, at most.
double closing_of_touching(const World& world) {
  double closing_m_s = 0.0;
  for (std::size_t i = 0; i + 1 < world.states.size(); ++i) {
    const BodyState &a = world.states[i], &b = world.states[i + 1];
    const Vec3 between = b.position_m - a.position_m;
    if (between.norm() > 2.0 * kRadius_m * (1.0 + 1e-9)) continue;
    closing_m_s = std::max(
        closing_m_s, (a.linear_velocity_m_s - b.linear_velocity_m_s).dot(between.normalized()));
  }
  return closing_m_s;
}

// Off the line of centres: nothing says where they go, but for what contact laws do. With friction
// Newton's method may give up, and iterations leave a trace.
struct Traces {
  int steps = 0;             // in which something closes at more than 1e-4 m/s
  double closing_m_s = 0.0;  // the largest
};

Traces traces_of(double friction, int n, double aside_m) {
  World world = ball_row(n, 0.0, 1.0, false);
  for (BodyParams& body : world.scene.bodies) body.material.friction = friction;
  for (int i = 0; i < n; ++i) world.states[i].position_m.y() = aside_m * (i % 2);
  world.states[0].linear_velocity_m_s = Vec3(1, 0.2, 0.1);
  const Mechanics before = measure(world.scene, world.ids, world.states);
  Traces traces;
  for (int step = 0; step < 60; ++step) {
    world.run(1);
    const double closing_m_s = closing_of_touching(world);
    traces.steps += closing_m_s > 1e-4;
    traces.closing_m_s = std::max(traces.closing_m_s, closing_m_s);
  }
  const Mechanics after = measure(world.scene, world.ids, world.states);
  EXPECT_LE((after.linear_momentum_newton_s - before.linear_momentum_newton_s).norm(), 1e-13);
  EXPECT_LE(after.kinetic_energy_joule, before.kinetic_energy_joule);
  return traces;
}

TEST(Blows, LeaveNothingThatClosesAndNoMomentum) {
  int sum = 0;  // of 5760 steps
  for (const int n : {4, 10, 16, 22, 28, 34})
    for (const double aside_m : {0.005, 0.01, 0.02, 0.025, 0.03, 0.035, 0.04, 0.05}) {
      EXPECT_LE(traces_of(0.0, n, aside_m).closing_m_s, 1e-6) << n << " balls";
      sum += traces_of(0.3, n, aside_m).steps + traces_of(0.6, n, aside_m).steps;
    }
  EXPECT_LE(sum, 120);
  for (const int n : {4, 10}) EXPECT_LE(traces_of(0.3, n, 0.03).closing_m_s, 1e-4) << n << " balls";
  const Traces longest = traces_of(0.3, 30, 0.03);
  EXPECT_LE(longest.closing_m_s, 1e-3);
  EXPECT_LE(longest.steps, 3);
}

// Faces meet in four points each and capsules side by side in two: what one point could bear.
World face_row(int n, double gap_m, double friction, bool boxes) {
  World world = ball_row(n, gap_m, 1.0, true);
  const Material material{.friction = friction, .restitution = 0.0};
  const std::uint32_t shape =
      boxes ? world.add_shape(Box{Vec3::Constant(kRadius_m)})
            : world.add_shape(Capsule{.radius_m = kRadius_m, .length_m = 0.3});
  World row;
  row.scene.gravity_m_s2 = world.scene.gravity_m_s2;
  row.scene.shapes = world.scene.shapes;
  row.scene.statics = world.scene.statics;  // smooth
  for (int i = 0; i < n; ++i) {
    row.add_body(shape, world.states[i].position_m, 1000.0, material) = world.states[i];
    if (!boxes) row.states[i].orientation = turn_between(Vec3::UnitZ(), Vec3::UnitY());
  }
  return row;
}

TEST(Blows, FacesGoOnTogetherForAnyNumber) {
  for (const bool boxes : {true, false})
    for (const double friction : {0.0, 0.4})
      for (const int n : {3, 4, 5, 8, 16, 33, 60}) {
        World world = face_row(n, 0.0, friction, boxes);
        world.run(3);
        double off = 0.0;
        for (const BodyState& state : world.states)
          off = std::max(off, (state.linear_velocity_m_s - Vec3(1.0 / n, 0, 0)).norm());
        EXPECT_LE(off, 1e-4) << n << " boxes " << boxes << ", friction " << friction;
      }
}

// Several blows in a step, each on what went on together before.
TEST(Blows, FacesAreTakenAlongOneAfterTheOther) {
  for (const bool boxes : {true, false})
    for (const double friction : {0.0, 0.4})
      for (const int n : {3, 5, 8}) {
        constexpr double kGap_m = 0.0015;
        World world = face_row(n, kGap_m, friction, boxes);
        double needed_s = kDistance_m;
        for (int i = 2; i < n; ++i) needed_s += kGap_m * i;
        world.run(static_cast<int>(needed_s / world.scene.dt_s) + 3);
        double off = 0.0;
        for (const BodyState& state : world.states)
          off = std::max(off, (state.linear_velocity_m_s - Vec3(1.0 / n, 0, 0)).norm());
        EXPECT_LE(off, 2e-3) << n << " boxes " << boxes << ", friction " << friction;
      }
}

TEST(Blows, AreLeftToTheIterationsWhereTheDirectSolverIsOff) {
  World world = ball_row(5, 0.0, 1.0, false);
  world.scene.solver.direct = false;
  EXPECT_FALSE(blows_needed(world.scene));
  world.run(3);
  EXPECT_EQ(world.counters.factor_multiplications, 0u);
  EXPECT_EQ(world.counters.blows + world.counters.blows_left, 0u);
}

TEST(Blows, AreNotLookedForInWhatRests) {
  World world;
  world.add_floor({.friction = 0.5, .restitution = 0.0});
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  world.scene.solver.rest = false;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.5, 0.5, 0.5)});
  for (int i = 0; i < 5; ++i) world.add_body(box, Vec3(0, 0, 0.5 + i));
  world.run(60);
  EXPECT_EQ(world.counters.blows + world.counters.blows_left, 0u);
}

}  // namespace
}  // namespace soda::physics
