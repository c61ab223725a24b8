// Steps refined to a tolerance: their errors, and what they say of them.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::under_gravity;
using test::World;

double friction_of(const World& world) {
  return std::sqrt(world.scene.bodies[0].material.friction *
                   world.scene.statics[0].material.friction);
}

// A motion with a known end.
struct Motion {
  std::string name;
  World world;
  double duration_s = 0.0, width_m = 0.0;
  double growth = 1.0;  // of an error over the motion, by the motion's own instability
  std::function<double(const World&)> error_m;
};

// Slabs on each other, thrown along a floor.
Motion sliding_slabs(int count, double duration_s) {
  constexpr double kSpeed = 4.0;
  Motion motion{std::to_string(count) + " slabs", under_gravity(), duration_s, 0.2, 1.0, {}};
  World& world = motion.world;
  world.add_floor();
  const std::uint32_t slab = world.add_shape(Box{Vec3(0.5, 0.5, 0.1)});
  for (int i = 0; i < count; ++i)
    world.add_body(slab, Vec3(0, 0, 0.1 + 0.2 * i)).linear_velocity_m_s = Vec3(kSpeed, 0, 0);
  const double slowing = friction_of(world) * kGravity;
  const double time_s = std::min(duration_s, kSpeed / slowing);
  const double exact = kSpeed * time_s - 0.5 * slowing * time_s * time_s;
  motion.error_m = [exact](const World& end) {
    return std::abs(end.states[0].position_m.x() - exact);
  };
  return motion;
}

// It slides until its angular velocity has caught up, at 5/7 of its speed.
Motion sphere_that_starts_to_roll() {
  constexpr double kSpeed = 3.0, kDuration = 0.5, kRadius = 0.1;
  Motion motion{"sphere", under_gravity(), kDuration, 2.0 * kRadius, 1.0, {}};
  World& world = motion.world;
  world.add_floor();
  world.add_body(world.add_shape(Sphere{kRadius}), Vec3(0, 0, kRadius)).linear_velocity_m_s =
      Vec3(kSpeed, 0, 0);
  const double slowing = friction_of(world) * kGravity;
  const double slides_s = 2.0 * kSpeed / (7.0 * slowing);
  const double exact = kSpeed * slides_s - 0.5 * slowing * slides_s * slides_s +
                       5.0 / 7.0 * kSpeed * (kDuration - slides_s);
  motion.error_m = [exact](const World& end) {
    return std::abs(end.states[0].position_m.x() - exact);
  };
  return motion;
}

// The angle of a pendulum that falls from rest, by the classical Runge-Kutta method.
double fallen_rad(double start_rad, double squared_rate, double time_s) {
  constexpr int kSteps = 20'000;
  const double h = time_s / kSteps;
  double angle = start_rad, rate = 0.0;
  const auto pull = [squared_rate](double a) { return squared_rate * std::sin(a); };
  for (int i = 0; i < kSteps; ++i) {
    const double k1 = rate, l1 = pull(angle);
    const double k2 = rate + 0.5 * h * l1, l2 = pull(angle + 0.5 * h * k1);
    const double k3 = rate + 0.5 * h * l2, l3 = pull(angle + 0.5 * h * k2);
    const double k4 = rate + h * l3, l4 = pull(angle + h * k3);
    angle += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
    rate += h / 6.0 * (l1 + 2.0 * (l2 + l3) + l4);
  }
  return angle;
}

// A cube that falls over an edge which sticks to what is below it: a pendulum about the edge. That
// is a floor, or a block that lies on it and is `half_width_m` wide.
Motion cube_that_tips(double half_width_m = 0.0) {
  constexpr double kDuration = 0.3, kTilt = 0.35;  // of a side, from lying flat
  constexpr Material kRough{.friction = 1.0, .restitution = 0.0};
  Motion motion{"cube", under_gravity(), kDuration, 1.0, 1.0, {}};
  World& world = motion.world;
  world.add_floor(kRough);
  const double arm = std::sqrt(0.5), lean = M_PI / 4 - kTilt;
  const bool has_block = half_width_m > 0.0;
  const Vec3 edge(0, 0, has_block ? 1.0 : 0.0);
  BodyState& cube =
      world.add_body(world.add_shape(Box{Vec3(0.5, 0.5, 0.5)}),
                     edge + Vec3(-arm * std::sin(lean), 0, arm * std::cos(lean)), 1000.0, kRough);
  cube.orientation = test::about(Vec3::UnitY(), kTilt);
  if (has_block) {
    motion.name = "cube on block of " + std::to_string(half_width_m);
    world.add_body(world.add_shape(Box{Vec3(half_width_m, half_width_m, 0.5)}), Vec3(0, 0, 0.5),
                   1000.0, kRough);
  }
  const double squared_rate = kGravity * arm / (1.0 / 6.0 + 0.5);
  motion.growth = std::exp(std::sqrt(squared_rate) * kDuration);
  const double end = fallen_rad(lean, squared_rate, kDuration);
  const Vec3 exact = edge + Vec3(-arm * std::sin(end), 0, arm * std::cos(end));
  motion.error_m = [exact](const World& now) { return (now.states[0].position_m - exact).norm(); };
  return motion;
}

std::vector<Motion> motions() {
  std::vector<Motion> all;
  all.push_back(sliding_slabs(1, 0.5));
  all.push_back(sliding_slabs(1, 1.0));
  all.push_back(sliding_slabs(2, 0.5));
  all.push_back(sliding_slabs(4, 0.5));
  all.push_back(sphere_that_starts_to_roll());
  all.push_back(cube_that_tips());
  all.push_back(cube_that_tips(1.0));  // four times as heavy
  all.push_back(cube_that_tips(2.0));  // sixteen times
  return all;
}

struct Outcome {
  double error = 0.0, sum = 0.0, largest = 0.0;  // of a width
  bool reached = true;
  std::uint64_t steps = 0, refined_steps = 0;
};

Outcome run(Motion motion, double dt_s, double tolerance) {
  World& world = motion.world;
  world.scene.dt_s = dt_s;
  world.scene.tolerance = tolerance;
  const Geometry geometry(world.scene);
  Outcome outcome;
  outcome.steps = static_cast<std::uint64_t>(std::llround(motion.duration_s / dt_s));
  for (std::uint64_t i = 0; i < outcome.steps; ++i) {
    world.run(1, geometry);
    double estimate = 0.0;
    for (const IslandReport& island : world.report.islands) {
      estimate = std::max(estimate, island.error_estimate);
      outcome.reached = outcome.reached && !island.beyond_tolerance;
    }
    outcome.sum += estimate;
    outcome.largest = std::max(outcome.largest, estimate);
  }
  outcome.error = motion.error_m(world) / motion.width_m;
  outcome.refined_steps = world.counters.refined_steps;
  return outcome;
}

// What a step is off in place stays, what it is off in velocity goes on for the n steps after it,
// at most: an estimate holds the displacement of one step. So n times their sum bounds the end's
// error, but for the motion's own instability and for rounding. Here errors in velocity hardly add
// up: n tolerances are enough.
TEST(Refinement, TheErrorOfARunIsBoundedByTheEstimatesOfItsSteps) {
  constexpr double kRounding = 1e-10;
  for (const Motion& motion : motions())
    for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
      const Outcome outcome = run(motion, 1.0 / 60.0, tolerance);
      const double n = static_cast<double>(outcome.steps);
      const std::string what = motion.name + " to " + std::to_string(std::log10(tolerance));
      EXPECT_LE(outcome.error, motion.growth * n * outcome.sum + kRounding) << what;
      EXPECT_LE(outcome.error, n * tolerance) << what;
      EXPECT_TRUE(outcome.reached) << what;
      EXPECT_LE(outcome.largest, tolerance) << what;
    }
}

// Where all that is not smooth is friction that stops, and is found at once, it costs the same.
TEST(Refinement, ASmallerToleranceCostsMoreAndErrsLess) {
  constexpr std::uint64_t kTheSame = 2;
  for (const Motion& motion : motions()) {
    const Outcome coarse = run(motion, 1.0 / 60.0, 1e-2), fine = run(motion, 1.0 / 60.0, 1e-9);
    std::uint64_t cost = 0;
    for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9}) {
      const Outcome outcome = run(motion, 1.0 / 60.0, tolerance);
      EXPECT_GE(outcome.refined_steps + kTheSame, cost) << motion.name << " to " << tolerance;
      cost = outcome.refined_steps;
    }
    EXPECT_GE(fine.refined_steps + kTheSame, coarse.refined_steps) << motion.name;
    EXPECT_LT(fine.error, 1e-3 * coarse.error + 1e-10) << motion.name;
  }
}

double order_of(const Outcome& coarse, const Outcome& fine) {
  return std::log2(coarse.error / fine.error);
}

// One step or three trials at each of these lengths, at this tolerance: the order of the method.
TEST(Refinement, IsOfThirdOrderInStickingContact) {
  for (const double block_m : {0.0, 1.0, 2.0}) {
    const Motion motion = cube_that_tips(block_m);
    std::vector<Outcome> outcomes;
    for (const double dt : {1.0 / 40.0, 1.0 / 80.0, 1.0 / 160.0})
      outcomes.push_back(run(motion, dt, 1e-4));
    for (std::size_t i = 1; i < outcomes.size(); ++i)
      EXPECT_GE(order_of(outcomes[i - 1], outcomes[i]), 2.0) << motion.name;
  }
}

// A single body is refined unasked: to an error of its own, whatever the step.
TEST(Refinement, ASingleBodyNeedsNoToleranceToBeExact) {
  for (const double dt : {1.0 / 30.0, 1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0}) {
    const Outcome outcome = run(cube_that_tips(), dt, 0.0);
    EXPECT_LT(outcome.error, 1e-6) << dt;
    EXPECT_EQ(outcome.sum, 0.0) << "nothing was asked for";
  }
}

// So are a few bodies where their motion is smooth.
TEST(Refinement, AFewBodiesThatKeepTouchingAreOfThirdOrderUnasked) {
  for (const double block_m : {1.0, 2.0}) {
    const Outcome coarse = run(cube_that_tips(block_m), 1.0 / 240.0, 0.0);
    const Outcome middle = run(cube_that_tips(block_m), 1.0 / 480.0, 0.0);
    const Outcome fine = run(cube_that_tips(block_m), 1.0 / 960.0, 0.0);
    EXPECT_GE(order_of(coarse, middle), 2.5) << block_m;
    EXPECT_GE(order_of(middle, fine), 2.5) << block_m;
    EXPECT_LT(run(cube_that_tips(block_m), 1.0 / 60.0, 0.0).error, 1e-6) << block_m;
  }
}

TEST(Refinement, SeveralBodiesAtRestTakeOneStep) {
  World world = under_gravity();
  world.scene.solver.rest = false;
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 4; ++i) world.add_body(box, Vec3(0, 0, 0.5 + i));
  world.run(60);  // the first step finds their impulses
  const std::uint64_t settled = world.counters.refined_steps;
  world.run(60);
  EXPECT_EQ(world.counters.refined_steps, settled);
  EXPECT_EQ(world.counters.islands_solved, 120u);
}

// What is hit changes its velocity by more than gravity would: it has no limit to look for.
TEST(Refinement, SeveralBodiesThatAreHitTakeOneStep) {
  World world;
  const std::uint32_t box = world.add_shape(Box{});
  world.add_body(box, Vec3(0, 0, 0)).linear_velocity_m_s = Vec3(1, 0.1, 0);
  world.add_body(box, Vec3(1, 0.3, 0)).linear_velocity_m_s = Vec3(-1, 0, 0);
  world.run(10);
  EXPECT_GT(world.counters.islands_solved, 0u);
  EXPECT_EQ(world.counters.refined_steps, 0u);
}

// A rod that stands on one end and falls over it, which sticks: it swings too fast for the error of
// a single body, but smoothly, so that the limit of three trials (third order) is enough.
double fallen_rod_error_rad(double dt, std::uint64_t& most_refined) {
  constexpr double kDuration = 0.15, kLean = 0.2, kHalf = 0.5, kThin = 2e-3;
  World world = under_gravity();
  world.scene.dt_s = dt;
  world.add_floor(Material{.friction = 2.0, .restitution = 0.0});
  const Quat lean = test::about(Vec3::UnitY(), kLean);
  const Vec3 edge(kThin, 0, -kHalf);  // from the centre; it touches
  BodyState& rod = world.add_body(world.add_shape(Box{Vec3(kThin, kThin, kHalf)}), -(lean * edge),
                                  1000.0, Material{.friction = 2.0, .restitution = 0.0});
  rod.orientation = lean;
  const BodyParams& params = world.scene.bodies[0];
  const double squared_rate =
      params.mass_kg * kGravity * edge.norm() /
      (params.inertia_local_kg_m2(1, 1) + params.mass_kg * edge.squaredNorm());
  const double start = kLean - std::atan2(kThin, kHalf);  // of the centre, seen from the edge
  const Geometry geometry(world.scene);
  for (int i = 0; i < static_cast<int>(kDuration / dt + 0.5); ++i) {
    const std::uint64_t before = world.counters.refined_steps;
    world.run(1, geometry);
    most_refined = std::max(most_refined, world.counters.refined_steps - before);
  }
  const Vec3 up = world.states[0].orientation * Vec3::UnitZ();
  return std::abs(std::atan2(up.x(), up.z()) - kLean -
                  (fallen_rad(start, squared_rate, kDuration) - start));
}

TEST(Refinement, AThinRodThatFallsOverIsOfThirdOrderInSevenSolvesAStep) {
  std::uint64_t most_refined = 0;
  const double coarse = fallen_rod_error_rad(1.0 / 60.0, most_refined);
  EXPECT_EQ(most_refined, 6u);
  EXPECT_LT(coarse, 1e-5);
  const double fine = fallen_rod_error_rad(1.0 / 120.0, most_refined);
  EXPECT_GE(std::log2(coarse / fine), 2.5);
}

// A box thrown along a floor: the whole distance v^2 / (2 mu g), wherever in a step it stops.
TEST(Refinement, ABoxComesToRestWhereFrictionStopsIt) {
  for (const double dt : {1.0 / 60.0, 1.0 / 47.0, 0.1}) {
    World world;
    world.scene.dt_s = dt;
    world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
    world.add_floor();
    BodyState& box = world.add_body(world.add_shape(Box{Vec3(0.5, 0.5, 0.1)}), Vec3(0, 0, 0.1));
    box.linear_velocity_m_s = Vec3(2, 0, 0);
    const double friction = std::sqrt(world.scene.bodies[0].material.friction *
                                      world.scene.statics[0].material.friction);
    const double stops_s = 2.0 / (friction * kGravity);
    const auto sliding = static_cast<std::uint64_t>(stops_s / dt);  // whole steps
    world.run(static_cast<int>(2.0 / dt));
    // The end lies where two lines cross; 1e-11 of its width for each of some fifty parts at most.
    EXPECT_NEAR(world.states[0].position_m.x(), 2.0 / (friction * kGravity), 1e-10) << dt;
    EXPECT_LE(world.states[0].linear_velocity_m_s.norm(), 1e-9);
    EXPECT_GT(world.counters.refined_steps, 2 * sliding);
    EXPECT_LT(world.counters.refined_steps, 2 * sliding + 64) << "all that a step may take";
  }
}

// Friction on a slope is steady: two trials, of one and two steps, tell its whole course.
TEST(Refinement, UnderSteadyForcesABodyTakesThreeSolvesAStep) {
  World world;
  world.scene.gravity_m_s2 = Vec3(5, 0, -kGravity);
  world.add_floor();
  world.add_body(world.add_shape(Box{}), Vec3(0, 0, 0.5)).linear_velocity_m_s = Vec3(1, 0, 0);
  const double slowing = friction_of(world) * kGravity - 5.0;
  ASSERT_LT(slowing, 0.0);
  world.run(60);
  EXPECT_EQ(world.counters.refined_steps, 2u * 60u);
  const double time_s = 60 * world.scene.dt_s;
  EXPECT_NEAR(world.states[0].position_m.x(), time_s - 0.5 * slowing * time_s * time_s, 1e-12);
}

TEST(Refinement, ABodyAtRestTakesOneStep) {
  World world;
  world.scene.solver.rest = false;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  world.add_floor();
  world.add_body(world.add_shape(Box{Vec3(0.5, 0.5, 0.1)}), Vec3(0, 0, 0.1));
  world.run(60);
  EXPECT_EQ(world.counters.refined_steps, 0u);
  EXPECT_EQ(world.counters.islands_solved, 60u);
}

// A step's trials are driven from where each of their steps starts; the step reports what is more
// than drive_impulse tells of its own start.
TEST(Refinement, TheMomentumOfWhatIsDrivenIsAccountedFor) {
  World world = under_gravity();
  world.scene.tolerance = 1e-6;
  world.add_floor();
  world.add_body(world.add_shape(Box{Vec3(0.5, 0.5, 0.1)}), Vec3(0, 0, 0.1));
  world.scene.drives.push_back({.time_constant_s = 0.1,
                                .max_acceleration_m_s2 = 20.0,
                                .velocity_m_s = Vec3(3, 0, 0),
                                .lane = {}});
  BodyParams& params = world.scene.bodies[0];
  params.drive = 0;
  const auto momentum = [&] { return Vec3(world.states[0].linear_velocity_m_s * params.mass_kg); };
  for (int step = 0; step < 30; ++step) {
    const Vec3 before = momentum();
    const Vec3 given = drive_impulse(world.scene, world.ids, world.states).sum_newton_s;
    world.run(1);
    ASSERT_EQ(world.report.islands.size(), 1u);
    const Vec3 explained = given + world.report.islands[0].static_impulse_newton_s +
                           world.scene.gravity_m_s2 * (params.mass_kg * world.scene.dt_s);
    EXPECT_LE((momentum() - before - explained).norm(), 1e-12 * given.norm()) << step;
  }
  EXPECT_GT(world.states[0].linear_velocity_m_s.x(), 0.5);
  EXPECT_GT(world.counters.refined_steps, 0u);
}

// What is pushed apart has no limit for short steps: it is off by all that it moved.
TEST(Refinement, WhatIsPushedApartIsBeyondTheTolerance) {
  World world;
  world.scene.tolerance = 1e-6;
  const std::uint32_t ball = world.add_shape(Sphere{0.5});
  world.add_body(ball, Vec3(0, 0, 0));
  world.add_body(ball, Vec3(0.9, 0, 0));
  world.run(1);
  ASSERT_EQ(world.report.islands.size(), 1u);
  EXPECT_TRUE(world.report.islands[0].beyond_tolerance);
  const double moved = -world.states[0].position_m.x();
  EXPECT_GT(moved, 0.0);
  EXPECT_NEAR(world.report.islands[0].error_estimate, moved, 1e-12);
}

}  // namespace
}  // namespace soda::physics
