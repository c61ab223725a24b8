#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "physics/integrators/advance_once.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/newton_solver.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

double most_moved(const World& world, const std::vector<BodyState>& start) {
  double most = 0.0;
  for (std::size_t i = 0; i < start.size(); ++i)
    most = std::max(most, (world.states[i].position_m - start[i].position_m).norm());
  return most;
}

// A step's error is at most 1e-7 of what gravity does in it; this, always in one direction.
double drift_bound(const World& world, double seconds) {
  return 1e-7 * kGravity * world.scene.dt_s * seconds;
}

World stack(int boxes, double top_over_others, double offset_m) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  std::mt19937_64 random(1);
  const auto offset = [&] {
    return offset_m * (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
  };
  for (int i = 0; i < boxes; ++i) {
    const double x = offset(), y = offset();
    world.add_body(box, Vec3(x, y, 0.5 + i), i + 1 == boxes ? top_over_others : 1.0);
  }
  return world;
}

World pyramid(int rows, double spacing_m) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int row = 0; row < rows; ++row)
    for (int i = 0; i < rows - row; ++i)
      world.add_body(box, Vec3((i + 0.5 * row) * spacing_m, 0, 0.5 + row));
  return world;
}

TEST(DirectContacts, AHeavyBoxRestsOnLightOnesForAMinute) {
  for (const double ratio : {1.0, 10.0, 1e3, 1e4, 1e6}) {
    SCOPED_TRACE(ratio);
    World world = stack(10, ratio, 0.02);
    world.scene.solver.rest = false;
    const std::vector<BodyState> start = world.states;
    world.run(3600);
    EXPECT_LT(most_moved(world, start), drift_bound(world, 60.0));
    EXPECT_TRUE(world.report.islands.front().direct);
    // What each level carries is what stands on it, to the same part of it.
    double above = 0.0;
    for (std::size_t i = world.states.size(); i-- > 1;) {
      above += world.scene.bodies[i].mass_kg;
      double carried = 0.0;
      for (const ContactImpulse& c : world.states[i - 1].impulses)
        if (!is_static(c.other)) carried += c.normal_newton_s;
      EXPECT_NEAR(carried / (above * kGravity * world.scene.dt_s), 1.0, 1e-7);
    }
  }
}

// Where rounding does not let an error of accuracy mode be reached, the nearest that it lets is
// kept.
TEST(DirectContacts, AMillionfoldLoadStaysOnTenBoxesInAccuracyMode) {
  World world = stack(10, 1e6, 0.02);
  world.scene.tolerance = 1e-3;
  const std::vector<BodyState> start = world.states;
  world.run(900);
  EXPECT_LT(most_moved(world, start), drift_bound(world, 15.0));
}

// Beyond what double precision can hold, the heavy box falls; light ones are not thrown away by the
// impulses that stopped it.
TEST(DirectContacts, ABoxThatIsTooHeavyGainsNoEnergy) {
  for (const double ratio : {1e9, 1e12}) {
    SCOPED_TRACE(ratio);
    World world = stack(10, ratio, 0.02);
    const Geometry geometry(world.scene);
    const auto energy = [&world] {
      const Mechanics now = world.mechanics();
      return now.kinetic_energy_joule + now.potential_energy_joule;
    };
    const double start = energy();
    for (int i = 0; i < 200; ++i) {
      world.run(1, geometry);
      ASSERT_LE(energy(), start) << "step " << i;
    }
  }
}

TEST(DirectContacts, APyramidDoesNotMove) {
  World world = pyramid(20, 1.02);
  world.scene.solver.rest = false;
  const std::vector<BodyState> start = world.states;
  world.run(300);
  EXPECT_LT(most_moved(world, start), drift_bound(world, 5.0));
  EXPECT_EQ(world.counters.direct_islands, 300u);
  // One step of Newton's method and one factorisation once it rests.
  EXPECT_LT(world.counters.solver_iterations, 2u * 300u);
}

// With neighbours that touch, too: their contacts carry nothing, but are there.
TEST(DirectContacts, ADensePyramidDoesNotMove) {
  World world = pyramid(20, 1.0);
  world.scene.solver.rest = false;
  const std::vector<BodyState> start = world.states;
  world.run(100);
  // The first step may stop at its limit of factorisations, with 2 % of what gravity does in it; a
  // hundredth of that is left over after each of the steps that follow.
  EXPECT_LT(most_moved(world, start), 0.03 * kGravity * world.scene.dt_s * world.scene.dt_s);
  EXPECT_EQ(world.counters.direct_islands, 100u);
}

TEST(DirectContacts, CoincidentBoxesPartWithoutAJump) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 10; ++i) world.add_body(box, Vec3(0, 0, 0.5));
  const Geometry geometry(world.scene);
  double fastest = 0.0;
  for (int i = 0; i < 600; ++i) {
    world.run(1, geometry);
    for (const BodyState& s : world.states)
      fastest = std::max(fastest, s.linear_velocity_m_s.norm());
  }
  EXPECT_LT(fastest, 1.0);
  double overlap = 0.0;
  for (const IslandReport& island : world.report.islands)
    overlap = std::max(overlap, island.max_penetration_m);
  EXPECT_LT(overlap, 6e-4) << "the slop is 5e-4; the rest goes by a fifth each step";
}

// Of all bodies as one island, not refined.
IslandReport take_one_plain_step(World& world) {
  const Geometry geometry(world.scene);
  StepScratch& scratch = world.scratch;
  compute_boxes(world.scene, geometry, world.ids, world.states, scratch.boxes, world.counters);
  find_contacts(world.scene, geometry, world.ids, world.states, scratch, world.counters);
  std::vector<AdvanceFault> faults;
  SolveScratch memory;
  return advance_once(whole_step(world.scene, geometry, world.ids, scratch.manifolds),
                      Exactness::kOngoing, world.states, {memory, world.counters, faults});
}

TEST(DirectContacts, IterationsComeToTheSameImpulses) {
  // A light box slides on a heavy one: too uneven for the iterations that two boxes get otherwise,
  // and little enough for iterations to converge.
  World direct = test::under_gravity();
  direct.add_floor();
  const std::uint32_t box = direct.add_shape(Box{});
  direct.add_body(box, Vec3(0, 0, 0.5), 12000.0).linear_velocity_m_s = Vec3(0, 0.01, 0);
  direct.add_body(box, Vec3(0.3, 0.1, 1.5), 1000.0).linear_velocity_m_s = Vec3(0.3, 0, 0);
  World swept = direct;
  swept.scene.solver.direct = false;
  swept.scene.solver.iterations = 1000;
  EXPECT_TRUE(take_one_plain_step(direct).direct);
  EXPECT_FALSE(take_one_plain_step(swept).direct);
  EXPECT_EQ(swept.counters.factor_multiplications, 0u);
  ASSERT_LT(swept.counters.solver_iterations, 1000u) << "they converged";
  for (std::size_t i = 0; i < direct.states.size(); ++i) {
    const BodyState &a = direct.states[i], &b = swept.states[i];
    EXPECT_LT((a.linear_velocity_m_s - b.linear_velocity_m_s).norm(), 1e-8);
    EXPECT_LT((a.angular_velocity_rad_s - b.angular_velocity_rad_s).norm(), 1e-8);
  }
}

TEST(DirectContacts, CollisionsKeepMomentumExactly) {
  World world;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.5, 0.4, 0.3)});
  std::mt19937_64 random(4);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
  for (int i = 0; i < 27; ++i) {
    const double density = i % 9 == 0 ? 20000.0 : 1000.0;  // else what moves is left to iterations
    BodyState& s = world.add_body(box, Vec3(i % 3, i / 3 % 3, i / 9) * 1.3, density);
    s.linear_velocity_m_s = -2.0 * (s.position_m - Vec3(1.3, 1.3, 1.3));
    s.angular_velocity_rad_s = Vec3(unit(), unit(), unit());
  }
  const Mechanics start = world.mechanics();
  world.run(60);
  const Mechanics end = world.mechanics();
  EXPECT_GT(world.counters.direct_islands, 0u);
  EXPECT_LT((end.linear_momentum_newton_s - start.linear_momentum_newton_s).norm(),
            1e-13 * start.momentum_scale_newton_s);
}

TEST(DirectContacts, WhatBouncesIsLeftToIterations) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 3; ++i)
    world.add_body(box, Vec3(0, 0, 0.51 + 1.01 * i), 1.0, Material{0.5, 0.5}).linear_velocity_m_s =
        Vec3(0, 0, -1);
  world.run(1);
  EXPECT_GT(world.counters.restitution_rows, 0u);
  EXPECT_EQ(world.counters.direct_islands, 0u);
  EXPECT_EQ(world.counters.factor_multiplications, 0u);
}

// One cube of 1 kg with four corners on a floor, sliding with 3 m/s.
TEST(NewtonSolver, ASlidingBodyIsNotLifted) {
  constexpr double kFriction = 0.5, kDt = 1.0 / 60.0;
  ConvexContacts problem;
  problem.bodies.push_back({1.0, Mat3(Mat3::Identity() / 6.0)});
  problem.free.push_back({Vec3(3, 0, -kGravity * kDt), Vec3::Zero()});
  problem.compliance_1_kg = 1.0;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      ConvexPoint p;
      p.a = 0;
      p.b = 1;  // the floor; the normal points to it
      p.normal = -Vec3::UnitZ();
      p.arm_a = Vec3(x, y, -0.5);
      p.friction = kFriction;
      problem.points.push_back(p);
    }
  }
  const auto plan = plan_elimination(1, {}, 1e9);
  ASSERT_TRUE(plan);
  std::vector<Twist> twists = problem.free;
  Responses responses;
  const NewtonLimits limits{3.0, 1e-12, 1e-9, 1e-9, 100, 100};
  ASSERT_TRUE(solve_by_newton(limits, *plan, problem, twists, responses).converged);
  EXPECT_NEAR(twists[0].linear.z(), 0.0, 1e-9);
  EXPECT_NEAR(twists[0].linear.x(), 3.0 - kFriction * kGravity * kDt, 1e-9);
  EXPECT_LT(twists[0].angular.norm(), 1e-9);
  for (const PointResponse& r : responses.points) {
    EXPECT_EQ(r.mode, ContactMode::kSlide);
    EXPECT_NEAR(r.impulse_newton_s.x(), kFriction * -r.impulse_newton_s.z(), 1e-9);
  }
}

}  // namespace
}  // namespace soda::physics
