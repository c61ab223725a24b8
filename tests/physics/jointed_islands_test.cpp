// Islands of joints and contacts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/math/rigid_motion.hpp"
#include "tests/physics/joints.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::joint_at;
using test::largest_gap_m;
using test::World;

World lying_chain(int links) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t link = world.add_shape(Box{{0.4, 0.1, 0.1}});
  for (int i = 0; i < links; ++i) world.add_body(link, Vec3(i, 0, 0.1));
  for (int i = 1; i < links; ++i)
    add(world, joint_at(JointKind::kBall, world, static_cast<std::uint32_t>(i - 1),
                        static_cast<std::uint32_t>(i), Vec3(i - 0.5, 0, 0.1)));
  return world;
}

TEST(JointedIslands, AChainThatLiesComesToRestAndCostsNothing) {
  for (const int links : {2, 16, 100}) {
    World world = lying_chain(links);
    world.run(10);
    const std::vector<BodyState> before = world.states;
    const std::uint64_t solved = world.counters.islands_solved;
    world.run(50);
    EXPECT_EQ(world.counters.islands_solved, solved) << links;
    for (std::size_t i = 0; i < before.size(); ++i)
      EXPECT_TRUE(identical(before[i], world.states[i])) << links << ", body " << i;
  }
}

// Rounding is no energy that contacts would give, so they are not given up.
TEST(JointedIslands, AChainThatLiesStaysInItsFirstStepWhateverItsLength) {
  for (int links = 2; links <= 64; ++links) {
    World world = test::under_gravity();
    world.add_floor();
    const std::uint32_t link = world.add_shape(Box{{0.1, 0.025, 0.025}});
    for (int i = 0; i < links; ++i) world.add_body(link, Vec3((i + 0.5) * 0.2, 0, 0.025));
    for (int i = 1; i < links; ++i)
      add(world, joint_at(JointKind::kBall, world, static_cast<std::uint32_t>(i - 1),
                          static_cast<std::uint32_t>(i), Vec3(i * 0.2, 0, 0.025)));
    const std::vector<BodyState> start = world.states;
    world.run(1);
    for (std::size_t i = 0; i < start.size(); ++i)
      EXPECT_LE((world.states[i].position_m - start[i].position_m).norm(), 1e-10)
          << links << " links, body " << i;
  }
}

// Two boxes on a hinge that slide to a stop, one of them turned.
World sliding_pair(std::optional<JointLimits> limits) {
  World world = test::under_gravity();
  world.add_floor(Material{.friction = 0.3});
  const std::uint32_t box = world.add_shape(Box{{0.4, 0.2, 0.1}});
  for (int i = 0; i < 2; ++i) {
    world.add_body(box, Vec3(i, 0, 0.1), 1.0 + 3.0 * i, Material{.friction = 0.3});
    world.states[i].linear_velocity_m_s = Vec3(2, 1 - 2 * i, 0);
  }
  Joint& hinge = add(world, joint_at(JointKind::kHinge, world, 0, 1, Vec3(0.5, 0, 0.1)));
  hinge.limits = limits;
  return world;
}

// What a solve may leave is measured by what it has to change, and not by how far away stops are.
TEST(JointedIslands, StopsThatAreFarAwayChangeNothing) {
  World free = sliding_pair(std::nullopt), stopped = sliding_pair(JointLimits{-3000.0, 3000.0});
  for (int step = 0; step < 60; ++step) {
    free.run(1);
    stopped.run(1);
    for (std::size_t i = 0; i < 2; ++i)
      ASSERT_LE((free.states[i].position_m - stopped.states[i].position_m).norm(), 1e-8)
          << "step " << step << ", body " << i;
  }
}

// Hinged planks of 1 kg between two walls, and a ball that falls on them.
// Hinged planks of 1 kg and half a metre that hang by a tenth of their span.
double sag_m(int planks) { return 0.05 * planks; }

World slack_bridge(int planks, int rate) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / rate;
  const auto place = [planks](int i) {
    const double x = 2.0 * i / planks - 1.0;
    return Vec3(0.25 * planks * x, 0, -sag_m(planks) * (1.0 - x * x));
  };
  for (int i = 0; i < planks; ++i) {
    const Vec3 along = place(i + 1) - place(i);
    const double length = along.norm();
    const std::uint32_t plank = world.add_shape(Box{{0.48 * length, 0.5, 0.05}});
    world.add_body(plank, 0.5 * (place(i) + place(i + 1)), 1.0 / (0.96 * length * 0.1))
        .orientation = turn_between(Vec3::UnitX(), along);
  }
  for (int i = 0; i <= planks; ++i) {
    const bool end = i == 0 || i == planks;
    add(world, joint_at(JointKind::kHinge, world, static_cast<std::uint32_t>(std::max(i - 1, 0)),
                        end ? std::nullopt : std::optional(static_cast<std::uint32_t>(i)), place(i),
                        Vec3::UnitY()));
  }
  return world;
}

TEST(JointedIslands, ASlackBridgeCarriesAHeavyBall) {
  constexpr int kPlanks = 8;
  for (const auto& [ratio, rate] :
       {std::pair(10.0, 60), {50.0, 60}, {200.0, 240}, {1000.0, 30}, {1000.0, 60}, {1000.0, 240}}) {
    World world = slack_bridge(kPlanks, rate);
    const double volume = 4.0 / 3.0 * M_PI * 0.027;
    world.add_body(world.add_shape(Sphere{0.3}), Vec3(0.02, 0, 0.36 - sag_m(kPlanks)),
                   ratio / volume);
    world.run(3 * rate);
    EXPECT_GT(world.states[kPlanks].position_m.z(), -2.0) << ratio;
    double overlap_m = 0.0;
    for (const IslandReport& island : world.report.islands)
      overlap_m = std::max(overlap_m, island.max_penetration_m);
    EXPECT_LT(overlap_m, 0.01) << ratio;
    EXPECT_LT(largest_gap_m(world), 1e-9) << ratio;
  }
}

// What a step lets a load sink by is little, and was not looked at: the box went through, .7 mm a
// step.
TEST(JointedIslands, ASlackBridgeCarriesABoxOf3000TimesAPlanksMass) {
  for (const int planks : {8, 12, 24}) {
    World world = slack_bridge(planks, 60);
    world.add_body(world.add_shape(Box{{0.25, 0.25, 0.25}}), Vec3(0.02, 0, 0.375 - sag_m(planks)),
                   3000.0 / 0.125);
    double overlap_m = 0.0;
    for (int step = 0; step < 180; ++step) {
      world.run(1);
      for (const IslandReport& island : world.report.islands)
        overlap_m = std::max(overlap_m, island.max_penetration_m);
    }
    EXPECT_GT(world.states[planks].position_m.z(), -sag_m(planks)) << planks;
    EXPECT_LT(overlap_m, 0.01) << planks;
  }
}

constexpr double kPlank_m = 0.35;

// Hinged planks of 20 kg in one straight line between two walls: nothing but endless tension holds
// them there, and no direction that the joints have in it.
World taut_bridge(int planks, int rate) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / rate;
  world.add_floor();
  const Vec3 half(0.165, 0.26, 0.0175);
  const std::uint32_t plank = world.add_shape(Box{half});
  for (int i = 0; i < planks; ++i)
    world.add_body(plank, Vec3((i + 0.5) * kPlank_m, 0, 2.0), 20.0 / (8.0 * half.prod()));
  for (int i = 0; i <= planks; ++i) {
    const bool end = i == 0 || i == planks;
    add(world, joint_at(JointKind::kHinge, world, static_cast<std::uint32_t>(std::max(i - 1, 0)),
                        end ? std::nullopt : std::optional(static_cast<std::uint32_t>(i)),
                        Vec3(i * kPlank_m, 0, 2.0), Vec3::UnitY()));
  }
  return world;
}

double lowest_m(const World& world, int planks) {
  double lowest = 1e300;
  for (int i = 0; i < planks; ++i) lowest = std::min(lowest, world.states[i].position_m.z());
  return lowest;
}

// An exact solver leaves it straight. Sag is the loss of order that the work of a step allows;
// before the stiffness of pulls was counted, 30 planks fell to the floor, and 12 tore at 30 steps a
// second.
TEST(JointedIslands, ATautBridgeHangsNearlyStraightFromAnyNumberOfPlanks) {
  for (const int planks : {2, 3, 4, 6, 8, 12, 16, 24, 32, 48})
    for (const int rate : {60, 240}) {
      World world = taut_bridge(planks, rate);
      world.run(2 * rate);
      EXPECT_TRUE(world.report.faults.empty())
          << planks << " planks, " << rate << " steps a second";
      EXPECT_GT(lowest_m(world, planks), 2.0 - 0.006 * planks * kPlank_m)
          << planks << " planks, " << rate << " steps a second";
    }
}

TEST(JointedIslands, ATautBridgeCarriesWhatFallsOnItBouncingOrNot) {
  for (const int planks : {4, 12, 30})
    for (const double restitution : {0.0, 0.5, 0.9})
      for (const double ratio : {0.05, 1.0, 10.0}) {
        World world = taut_bridge(planks, 60);
        const Material material{0.5, restitution};
        const double volume = 4.0 / 3.0 * M_PI * 0.15 * 0.15 * 0.15;
        world.add_body(world.add_shape(Sphere{0.15}), Vec3(0.5 * planks * kPlank_m, 0, 3.2),
                       20.0 * ratio / volume, material);
        for (int step = 0; step < 180; ++step) {
          world.run(1);
          ASSERT_TRUE(world.report.faults.empty())
              << planks << " planks, restitution " << restitution << ", ratio " << ratio;
        }
        EXPECT_GT(lowest_m(world, planks), 2.0 - 0.02 * planks * kPlank_m)
            << planks << " planks, restitution " << restitution << ", ratio " << ratio;
        EXPECT_GT(world.states[planks].position_m.z(), 2.0 - 0.02 * planks * kPlank_m)
            << planks << " planks, restitution " << restitution << ", ratio " << ratio;
      }
}

// A box falls on the end of a plank on a hinge over a post, which then lies aslant between box,
// post and floor.
TEST(JointedIslands, ALeverBearsAnyMass) {
  constexpr double kPlank_kg = 1.0;
  for (const double box_kg : {0.1, 1.0, 1e2, 1e3, 9e3, 1e4, 2e4, 1e5, 1e6}) {
    World world = test::under_gravity();
    world.add_floor({.friction = 0.6});
    world.add_static(world.add_shape(Box{Vec3(0.15, 0.25, 0.45)}), Vec3(0, 0, 0.45),
                     Quat::Identity(), {.friction = 0.6});
    const Vec3 half(2.0, 0.25, 0.05);
    world.add_body(world.add_shape(Box{half}), Vec3(0, 0, 1.0), kPlank_kg / (8 * half.prod()),
                   {.friction = 0.6});
    world.add_body(world.add_shape(Box{Vec3::Constant(0.25)}), Vec3(1.7, 0, 1.85), 8.0 * box_kg,
                   {.friction = 0.6});
    test::add(world, test::joint_at(JointKind::kHinge, world, 0, std::nullopt, Vec3(0, 0, 1.0),
                                    Vec3::UnitY()));
    double deepest_m = 0.0;
    for (int step = 0; step < 300; ++step) {
      world.run(1);
      for (const IslandReport& island : world.report.islands)
        deepest_m = std::max(deepest_m, island.max_penetration_m);
    }
    EXPECT_LE(deepest_m, 2e-4) << box_kg << " kg";
    EXPECT_LE(test::largest_gap_m(world), 1e-9) << box_kg << " kg";
  }
}

// Two balls that a fixed joint holds beside each other fall on the floor: both leave it at e times
// the speed that they came with.
TEST(JointedIslands, WhatJointsHoldReboundsAsItsMaterialSays) {
  for (const double restitution : {0.3, 0.5, 0.8, 1.0}) {
    World world = test::under_gravity();
    const Material material{0.5, restitution};
    world.add_floor(material);
    const std::uint32_t ball = world.add_shape(Sphere{0.1});
    for (int i = 0; i < 2; ++i) world.add_body(ball, Vec3(0.5 * i, 0, 0.5), 1000.0, material);
    add(world, joint_at(JointKind::kFixed, world, 0, 1, Vec3(0.25, 0, 0.5)));
    double fastest_m_s = 0.0, rebound_m_s = 0.0;
    for (int step = 0; step < 240 && rebound_m_s <= 0.0; ++step) {
      fastest_m_s = std::max(fastest_m_s, -world.states[0].linear_velocity_m_s.z());
      world.run(1);
      rebound_m_s = world.states[0].linear_velocity_m_s.z();
      EXPECT_NEAR(world.states[1].linear_velocity_m_s.z(), rebound_m_s, 1e-9);
    }
    EXPECT_NEAR(rebound_m_s, restitution * fastest_m_s, 0.1 * fastest_m_s) << restitution;
  }
}

}  // namespace
}  // namespace soda::physics
