// Ropes of beads on distance joints: what pulls along a line turns as its ends move across it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "physics/math/rigid_motion.hpp"
#include "physics/measures/measures.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::energy_joule;
using test::World;

constexpr Material kIce{.friction = 0.0, .restitution = 0.0};
constexpr Material kRough{.friction = 0.5, .restitution = 0.0};

double kinetic_joule(const World& world) { return world.mechanics().kinetic_energy_joule; }

std::uint32_t add_ball(World& world, const Vec3& place_m, double radius_m, double mass_kg) {
  const auto body = static_cast<std::uint32_t>(world.states.size());
  const double volume_m3 = 4.0 / 3.0 * M_PI * radius_m * radius_m * radius_m;
  world.add_body(world.add_shape(Sphere{radius_m}), place_m, mass_kg / volume_m3, kIce);
  return body;
}

// From this place on a body to the centre of a later one.
void add_rod(World& world, std::uint32_t from, const Vec3& place_m, std::uint32_t to) {
  Joint joint = test::joint_at(JointKind::kDistance, world, from, to, place_m);
  joint.anchor_b_m = Vec3::Zero();
  joint.length_m = (world.states[to].position_m - place_m).norm();
  test::add(world, joint);
}

void add_rod(World& world, std::uint32_t from, std::uint32_t to) {
  add_rod(world, from, world.states[from].position_m, to);
}

// Beads around the upper half of a cylinder without friction, a load at either end.
struct Pulley {
  int beads;
  double bead_kg, lighter_kg, heavier_kg, dt_s;
};
World world_of(const Pulley& pulley) {
  constexpr double kRadius_m = 0.5, kBead_m = 0.02, kReach_m = kRadius_m + kBead_m;
  World world = test::under_gravity();
  world.scene.dt_s = pulley.dt_s;
  world.add_static(world.add_shape(Cylinder{kRadius_m, 0.2}), Vec3::Zero(),
                   turn_between(Vec3::UnitZ(), Vec3::UnitY()), kIce);
  for (int k = 0; k < pulley.beads; ++k) {
    const double angle = M_PI * k / (pulley.beads - 1);
    const std::uint32_t bead = add_ball(
        world, kReach_m * Vec3(-std::cos(angle), 0, std::sin(angle)), kBead_m, pulley.bead_kg);
    if (k > 0) add_rod(world, bead - 1, bead);
  }
  const std::uint32_t last = pulley.beads - 1;
  add_rod(world, 0, add_ball(world, Vec3(-kReach_m, 0, -0.8), 0.1, pulley.lighter_kg));
  add_rod(world, last, add_ball(world, Vec3(kReach_m, 0, -0.8), 0.1, pulley.heavier_kg));
  return world;
}

// Without stiffness it stood still.
TEST(JointStiffness, ARopeOfBeadsRunsOverAPulley) {
  for (const int beads : {9, 17, 33})
    for (const auto& [lighter_kg, heavier_kg] : {std::pair(1.0, 1.5), std::pair(20.0, 22.0)})
      for (const int steps_a_second : {30, 60, 120}) {
        const double bead_kg = 0.02, time_s = 0.6;
        const Pulley pulley{beads, bead_kg, lighter_kg, heavier_kg, 1.0 / steps_a_second};
        World world = world_of(pulley);
        const double start = energy_joule(world);
        world.run(static_cast<int>(std::lround(time_s * steps_a_second)));
        const double moved_kg = lighter_kg + heavier_kg + beads * bead_kg;
        const double speed = test::kGravity * (heavier_kg - lighter_kg) / moved_kg * time_s;
        const double joule = 0.5 * moved_kg * speed * speed;  // beads that change sides add to it
        EXPECT_LE(start - energy_joule(world), 3.5 / steps_a_second * joule) << beads;
        EXPECT_GE(kinetic_joule(world), (1.0 - 5.0 / steps_a_second) * joule) << beads;
        EXPECT_LE(test::largest_misfit_m(world), 1e-9)
            << beads << ", " << lighter_kg << ", " << steps_a_second;
      }
}

// It stood still, or sank in, with any.
TEST(JointStiffness, SoDoesOneWithRollingFriction) {
  for (const int beads : {9, 17, 33})
    for (const double rolling_m : {1e-8, 1e-6, 1e-4})
      for (const int steps_a_second : {30, 60, 120}) {
        World plain = world_of({beads, 0.02, 1.0, 1.5, 1.0 / steps_a_second});
        World world = world_of({beads, 0.02, 1.0, 1.5, 1.0 / steps_a_second});
        for (BodyParams& body : world.scene.bodies) body.material.rolling_friction_m = rolling_m;
        for (World* const each : {&plain, &world}) each->run(steps_a_second / 2);
        EXPECT_NEAR(kinetic_joule(world), kinetic_joule(plain), 0.05 * kinetic_joule(plain))
            << beads << ", " << rolling_m << ", " << steps_a_second;
        EXPECT_LE(test::largest_misfit_m(world), 1e-9) << beads << ", " << rolling_m;
      }
}

// By a fifth of the factorisations that short ones get, long ones sank in by half of a bead, and
// came open by millimetres.
TEST(JointStiffness, LongRopesHoldOnRoughCylinders) {
  for (const int beads : {33, 65})
    for (const double friction : {0.1, 0.3, 0.6})
      for (const double share : {0.9, 1.1}) {  // of the load at which they slip
        const double turn = M_PI / (beads - 1);
        const auto grip = [friction](double angle) {
          return (1.0 + friction * std::tan(0.5 * angle)) /
                 (1.0 - friction * std::tan(0.5 * angle));
        };
        const double most = std::pow(grip(turn), beads - 2) * std::pow(grip(0.5 * turn), 2);
        World world =
            world_of({beads, 0.02, 10.0, 10.0 * (1.0 + (most - 1.0) * share), 1.0 / 60.0});
        world.scene.statics[0].material.friction = friction;
        for (BodyParams& body : world.scene.bodies) body.material.friction = friction;
        double deepest_m = 0.0;
        for (int step = 0; step < 90; ++step) {
          world.run(1);
          for (const IslandReport& island : world.report.islands)
            deepest_m = std::max(deepest_m, island.max_penetration_m);
        }
        EXPECT_LT(deepest_m, 5e-3) << beads << ", " << friction << ", " << share;
        EXPECT_LT(test::largest_misfit_m(world), 3e-4) << beads << ", " << friction;
      }
}

// Springs alone are aimed at the end of the step, too.
TEST(JointStiffness, SoDoesARopeOfSprings) {
  for (const double bead_kg : {0.005, 0.02, 0.1})
    for (const int steps_a_second : {30, 60, 120}) {
      const double time_s = 0.6;
      World world = world_of({17, bead_kg, 1.0, 1.5, 1.0 / steps_a_second});
      for (Joint& joint : world.scene.joints) {
        joint.kind = JointKind::kSpring;
        joint.stiffness_newton_m = 2e5;
        joint.damping_newton_s_m = 20.0;
      }
      world.run(static_cast<int>(std::lround(time_s * steps_a_second)));
      const double moved_kg = 2.5 + 17 * bead_kg;
      const double speed = test::kGravity * 0.5 / moved_kg * time_s;
      EXPECT_GE(kinetic_joule(world), 0.5 * moved_kg * speed * speed) << bead_kg;
    }
}

// A net of balls on springs without damping, its edge tied to the world, and a ball over it.
World trampoline(int across, double stiffness_newton_m, double dt_s) {
  constexpr double kHalf_m = 1.0;
  const double spacing_m = 2.0 * kHalf_m / (across + 1), length_m = 0.8 * spacing_m;
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  const auto place = [&](int x, int y) {
    return Vec3((x + 1) * spacing_m - kHalf_m, (y + 1) * spacing_m - kHalf_m, 0);
  };
  const auto spring = [&](std::uint32_t a, std::optional<std::uint32_t> b, const Vec3& end_m) {
    Joint joint = test::joint_at(JointKind::kSpring, world, a, b, end_m);
    joint.anchor_a_m = Vec3::Zero();
    joint.length_m = length_m;
    joint.stiffness_newton_m = stiffness_newton_m;
    test::add(world, joint);
  };
  for (int x = 0; x < across; ++x)
    for (int y = 0; y < across; ++y)
      add_ball(world, place(x, y), 0.3 * spacing_m, 5.0 / (across * across));
  for (int x = 0; x < across; ++x)
    for (int y = 0; y < across; ++y) {
      const auto body = static_cast<std::uint32_t>(x * across + y);
      if (x + 1 < across) spring(body, body + across, place(x + 1, y));
      if (y + 1 < across) spring(body, body + 1, place(x, y + 1));
      if (x == 0) spring(body, std::nullopt, place(-1, y));
      if (x + 1 == across) spring(body, std::nullopt, place(across, y));
      if (y == 0) spring(body, std::nullopt, place(x, -1));
      if (y + 1 == across) spring(body, std::nullopt, place(x, across));
    }
  add_ball(world, Vec3(0.03, 0.02, 1.5), 0.4, 20.0);
  return world;
}

// Where the ball is lowest, and the highest place after that, within 1.2 s.
std::pair<double, double> lowest_and_highest_m(World world) {
  const Geometry geometry(world.scene);
  double lowest = 1e300, highest = -1e300;
  for (int i = 0; i < std::lround(1.2 / world.scene.dt_s); ++i) {
    world.run(1, geometry);
    const double now = world.states.back().position_m.z();
    highest = now < lowest ? now : std::max(highest, now);
    lowest = std::min(lowest, now);
  }
  return {lowest, highest};
}

// Springs so stiff are solved implicitly, which takes energy; without aims the ball stuck in the
// air.
TEST(JointStiffness, ATrampolineOfSpringsThrowsBack) {
  for (const int across : {3, 6})
    for (const double stiffness_newton_m : {2e3, 2e4}) {
      const auto [low, high] =
          lowest_and_highest_m(trampoline(across, stiffness_newton_m, 1.0 / 60.0));
      const auto [lowest, highest] =
          lowest_and_highest_m(trampoline(across, stiffness_newton_m, 1.0 / 480.0));
      EXPECT_NEAR(low, lowest, 0.05 * (1.5 - lowest)) << across << ", " << stiffness_newton_m;
      EXPECT_GE(high, lowest + 0.3 * (highest - lowest)) << across << ", " << stiffness_newton_m;
    }
}

// From a heavy stand on a floor.
TEST(JointStiffness, ALoadOnARopeOfBeadsSwingsOn) {
  constexpr double kAngle_rad = 0.7, kRope_m = 2.0;
  const Vec3 top(3.0, 0, 2.9), way(std::sin(kAngle_rad), 0, -std::cos(kAngle_rad));
  for (const int links : {1, 2, 4, 8, 16})
    for (const double load_kg : {1.0, 50.0})
      for (const double bead_kg : {0.1, 1.0}) {
        World world = test::under_gravity();
        world.add_floor(kRough);
        world.add_body(world.add_shape(Box{Vec3(1.5, 0.5, 1.5)}), Vec3(0, 0, 1.5),
                       (20.0 * load_kg + 50.0) / 9.0, kRough);
        for (int k = 1; k <= links; ++k) {
          const std::uint32_t body =
              add_ball(world, top + kRope_m * k / links * way, 0.02, k < links ? bead_kg : load_kg);
          add_rod(world, body - 1, k == 1 ? top : world.states[body - 1].position_m, body);
        }
        const double start = energy_joule(world), lift_m = kRope_m * (1.0 - std::cos(kAngle_rad));
        world.run(120);
        const double swings_kg = load_kg + 0.5 * (links - 1) * bead_kg;
        EXPECT_NEAR(start - energy_joule(world), 0.0, 0.015 * swings_kg * test::kGravity * lift_m)
            << links << ", " << load_kg << ", " << bead_kg;
        EXPECT_LE(test::largest_misfit_m(world), 1e-9)
            << links << ", " << load_kg << ", " << bead_kg;
      }
}

// A box that slides on pulls another one by a slack rope.
TEST(JointStiffness, ARopeOfBeadsThatBecomesTautHolds) {
  const Vec3 half = Vec3::Constant(0.25);
  for (const int beads : {3, 6, 12})
    for (const double box_kg : {30.0, 300.0, 3000.0})
      for (const double bead_kg : {0.05, 0.5})
        for (const double dt_s : {1.0 / 60.0, 1.0 / 120.0}) {
          World world = test::under_gravity();
          world.scene.dt_s = dt_s;
          world.add_floor(kRough);
          const std::uint32_t box = world.add_shape(Box{half});
          world.add_body(box, Vec3(0, 0, 0.25), 8.0 * box_kg, kRough);
          for (int k = 1; k <= beads; ++k) {
            const double part = static_cast<double>(k) / (beads + 1);
            const Vec3 place(0.25 + 2.0 * part, 0, 0.25 - 0.2 * std::sin(M_PI * part));
            const std::uint32_t bead = add_ball(world, place, 0.03, bead_kg);
            if (k == 1)
              add_rod(world, 0, Vec3(0.25, 0, 0.25), bead);
            else
              add_rod(world, bead - 1, bead);
          }
          world.add_body(box, Vec3(2.5, 0, 0.25), 16.0 * box_kg, kRough).linear_velocity_m_s =
              Vec3(3, 0, 0);
          Joint last =
              test::joint_at(JointKind::kDistance, world, beads, beads + 1, Vec3(2.25, 0, 0.25));
          last.anchor_a_m = Vec3::Zero();
          last.length_m = (world.states[beads].position_m - Vec3(2.25, 0, 0.25)).norm();
          test::add(world, last);
          world.run(static_cast<int>(std::lround(2.0 / dt_s)));
          EXPECT_GT(world.states[0].position_m.x(), 0.01) << beads << ", " << box_kg;
          EXPECT_LE(test::largest_misfit_m(world), 1e-9)
              << beads << ", " << box_kg << ", " << bead_kg;
        }
}

// What is not quite solved pulls across its lines at the world, too.
TEST(JointStiffness, WhatTheWorldGivesIsTold) {
  const Pulley pulley{9, 0.02, 1.0, 20.0, 1.0 / 60.0};
  World world = world_of(pulley);
  Joint tied =
      test::joint_at(JointKind::kDistance, world, 9, std::nullopt, world.states[9].position_m);
  tied.anchor_b_m = world.states[9].position_m - Vec3(0, 0, 0.5);
  tied.length_m = 0.5;
  test::add(world, tied);
  world.states[10].linear_velocity_m_s = Vec3(0.5, 0.3, 0);
  const Geometry geometry(world.scene);
  Vec3 unexplained = world.mechanics().linear_momentum_newton_s;
  double mass_kg = 0.0;
  for (const BodyParams& body : world.scene.bodies) mass_kg += body.mass_kg;
  for (int i = 0; i < 120; ++i) {
    world.run(1, geometry);
    unexplained += world.scene.gravity_m_s2 * (mass_kg * world.scene.dt_s);
    for (const IslandReport& island : world.report.islands)
      unexplained += island.static_impulse_newton_s;
    const Vec3 rest = unexplained - world.mechanics().linear_momentum_newton_s;
    ASSERT_LE(rest.norm(), 1e-9 * mass_kg) << i;
  }
  EXPECT_GT(world.counters.contact_points, 0u);
}

}  // namespace
}  // namespace soda::physics
