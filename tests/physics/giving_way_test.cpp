// Closing joints does not press bodies into what lies on them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/physics/joints.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::joint_at;
using test::World;

constexpr int kPlanks = 20;
constexpr double kPlank_m = 0.2, kHalfThickness_m = 0.05, kHeight_m = 3.0;

// Hinged planks of 1 kg in one straight line between two walls.
World taut_planks(int rate) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / rate;
  world.add_floor();
  const Vec3 half(0.45 * kPlank_m, 0.5, kHalfThickness_m);
  const std::uint32_t plank = world.add_shape(Box{half});
  for (int i = 0; i < kPlanks; ++i)
    world.add_body(plank, Vec3((i + 0.5) * kPlank_m, 0, kHeight_m), 1.0 / (8.0 * half.prod()));
  for (int i = 0; i <= kPlanks; ++i) {
    const bool end = i == 0 || i == kPlanks;
    add(world, joint_at(JointKind::kHinge, world, static_cast<std::uint32_t>(std::max(i - 1, 0)),
                        end ? std::nullopt : std::optional(static_cast<std::uint32_t>(i)),
                        Vec3(i * kPlank_m, 0, kHeight_m), Vec3::UnitY()));
  }
  return world;
}

enum class Load { kBox, kBall, kDumbbell };

// Falls on the middle from 30 cm.
void add_load(Load load, double mass_kg, World& world) {
  const double radius_m = 0.2;
  const Vec3 place(0.5 * kPlanks * kPlank_m + 0.03, 0.02,
                   kHeight_m + kHalfThickness_m + radius_m + 0.3);
  if (load == Load::kBox) {
    const double volume = 8.0 * radius_m * radius_m * radius_m;
    world.add_body(world.add_shape(Box{Vec3::Constant(radius_m)}), place, mass_kg / volume);
    return;
  }
  const double density = mass_kg / (4.0 / 3.0 * M_PI * radius_m * radius_m * radius_m);
  const std::uint32_t ball = world.add_shape(Sphere{radius_m});
  if (load == Load::kBall) {
    world.add_body(ball, place, density);
    return;
  }
  const Vec3 half(0.0, 0.25, 0.0);
  world.add_body(ball, place - half, 0.5 * density);
  world.add_body(ball, place + half, 0.5 * density);
  add(world, joint_at(JointKind::kFixed, world, kPlanks, kPlanks + 1, place));
}

double joule(const World& world) {
  return world.mechanics().kinetic_energy_joule + world.mechanics().potential_energy_joule;
}

// Planks cannot go down but to second order; each step drew them straight again, and into a load
// that was more than ten times as heavy, until it had fallen through.
TEST(GivingWay, WhatFallsOnATautBridgeLiesOnItHoweverHeavyItIs) {
  for (const Load load : {Load::kBox, Load::kBall, Load::kDumbbell})
    for (const double mass_kg : {1.0, 50.0, 1000.0, 2e4})
      for (const int rate : {60, 240}) {
        if (rate > 60 && load != Load::kBox) continue;
        SCOPED_TRACE("load " + std::to_string(static_cast<int>(load)) + ", " +
                     std::to_string(mass_kg) + " kg, " + std::to_string(rate) + " steps a second");
        World world = taut_planks(rate);
        add_load(load, mass_kg, world);
        double overlap_m = 0.0, before = joule(world), given = 0.0;
        for (int step = 0; step < rate * 3 / 2; ++step) {
          world.run(1);
          ASSERT_TRUE(world.report.faults.empty()) << step;
          for (const IslandReport& island : world.report.islands) {
            overlap_m = std::max(overlap_m, island.max_penetration_m);
            given += std::max(0.0, island.push_out_work_joule);
          }
        }
        EXPECT_LT(overlap_m, 0.5 * kHalfThickness_m);
        EXPECT_LE(joule(world) - before, given);
        for (std::size_t i = kPlanks; i < world.states.size(); ++i) {
          EXPECT_GT(world.states[i].position_m.z(), kHeight_m + 0.15);
          EXPECT_LT(world.states[i].linear_velocity_m_s.norm(), 0.5);
        }
      }
}

}  // namespace
}  // namespace soda::physics
