// Kinematic bodies: nothing that they meet changes their motion, and all else goes by it.
#include "physics/model/kinematic.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "physics/math/rigid_motion.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

BodyState& add_kinematic(World& world, const Shape& shape, const Vec3& position,
                         Material material = {}) {
  BodyState& state = world.add_body(world.add_shape(shape), position, 1000.0, material);
  BodyParams& params = world.scene.bodies.back();
  params.kinematic = true;
  params.mass_kg = 1.0;
  params.inertia_local_kg_m2 = Mat3::Identity();
  params.inverse_inertia_local = Mat3::Zero();
  return state;
}

Box box_of(double x, double y, double z) { return {Vec3(x, y, z)}; }

bool moves_alike(const BodyState& a, const BodyState& b) {
  return identical(motion_of(a), motion_of(b));
}

// An arm that turns and rises, among boxes and balls on a floor.
World swept(bool alone, bool direct) {
  World world = test::under_gravity();
  world.scene.solver.direct = direct;
  world.add_floor();
  BodyState& arm = add_kinematic(world, box_of(2.0, 0.1, 0.3), Vec3(0, 0, 0.4));
  arm.angular_velocity_rad_s = Vec3(0.1, 0, 2.0);
  arm.linear_velocity_m_s = Vec3(0.3, -0.1, 0.02);
  if (alone) return world;
  const std::uint32_t box = world.add_shape(box_of(0.2, 0.2, 0.2));
  const std::uint32_t ball = world.add_shape(Sphere{0.2});
  for (int i = 0; i < 12; ++i) {
    const double angle = 0.52 * i + 0.3;
    world.add_body(i % 2 == 0 ? box : ball, Vec3(1.4 * std::cos(angle), 1.4 * std::sin(angle), 0.2),
                   1000.0, {0.5, i % 3 == 0 ? 0.4 : 0.0});
  }
  return world;
}

TEST(Kinematic, MovesAsAloneBitForBitWhateverItMeets) {
  for (const bool direct : {true, false}) {
    World alone = swept(true, direct), among = swept(false, direct);
    const Geometry of_alone(alone.scene), of_among(among.scene);
    for (int i = 0; i < 240; ++i) {
      alone.run(1, of_alone);
      among.run(1, of_among);
      ASSERT_TRUE(moves_alike(alone.states[0], among.states[0])) << "step " << i;
      ASSERT_TRUE(among.report.faults.empty()) << "step " << i;
    }
    double moved = 0.0;
    const World start = swept(false, direct);
    for (std::size_t i = 1; i < among.states.size(); ++i)
      moved = std::max(moved, (among.states[i].position_m - start.states[i].position_m).norm());
    EXPECT_GT(moved, 0.5);  // it has met them
  }
}

// v' = v + (1 + e) (u - v), whichever of the two has the lower id.
TEST(Kinematic, ReflectsABallExactly) {
  for (const bool first : {true, false})
    for (const double restitution : {0.0, 0.3, 1.0})
      for (const double paddle : {-1.0, 0.0, 2.0, 20.0}) {
        World world;
        const auto add_paddle = [&] {
          add_kinematic(world, box_of(1, 1, 0.1), Vec3::Zero()).linear_velocity_m_s =
              Vec3(0, 0, paddle);
        };
        if (first) add_paddle();
        world
            .add_body(world.add_shape(Sphere{0.1}), Vec3(0.2, 0.1, 0.7), 1000.0, {0.0, restitution})
            .linear_velocity_m_s = Vec3(0, 0, -3);
        if (!first) add_paddle();
        world.run(60);
        const double expected = -3.0 + (1.0 + restitution) * (paddle + 3.0);
        EXPECT_NEAR(world.states[first ? 1 : 0].linear_velocity_m_s.z(), expected, 1e-12)
            << first << " " << restitution << " " << paddle;
        EXPECT_EQ(world.states[first ? 0 : 1].linear_velocity_m_s, Vec3(0, 0, paddle));
      }
}

// Under gravity, a ball that falls on a paddle which rises: the time of the impact is known.
TEST(Kinematic, ReflectsAFallingBallWhereTheyMeet) {
  World world = test::under_gravity();
  add_kinematic(world, box_of(1, 1, 0.1), Vec3::Zero()).linear_velocity_m_s = Vec3(0, 0, 1);
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, 1.2), 1000.0, {0.0, 0.8});
  const double meets_s = (-1.0 + std::sqrt(1.0 + 2.0 * kGravity)) / kGravity;  // 1 m apart
  const double after = -kGravity * meets_s + 1.8 * (1.0 + kGravity * meets_s);
  const int steps = 45;
  world.run(steps);
  const double rest_s = steps * world.scene.dt_s - meets_s;
  EXPECT_NEAR(world.states[1].linear_velocity_m_s.z(), after - kGravity * rest_s, 1e-6);
  EXPECT_NEAR(world.states[1].position_m.z(),
              0.2 + meets_s + after * rest_s - 0.5 * kGravity * rest_s * rest_s, 1e-6);
}

TEST(Kinematic, CarriesAStackAndLetsItRestWhereItStands) {
  World world = test::under_gravity();
  add_kinematic(world, box_of(1, 1, 0.1), Vec3(0, 0, 0.1)).linear_velocity_m_s = Vec3(0.5, 0, 1);
  world.add_floor();  // it does not touch it
  const std::uint32_t box = world.add_shape(box_of(0.25, 0.25, 0.25));
  for (int i = 0; i < 4; ++i)
    world.add_body(box, Vec3(0, 0, 0.45 + 0.5 * i)).linear_velocity_m_s = Vec3(0.5, 0, 1);
  const Geometry geometry(world.scene);
  world.run(120, geometry);
  for (int i = 0; i < 4; ++i) {
    const Vec3 place = world.states[i + 1].position_m - world.states[0].position_m;
    EXPECT_NEAR(place.z(), 0.35 + 0.5 * i, 0.006 * (i + 1));  // a slop a contact
    EXPECT_LT(std::hypot(place.x(), place.y()), 1e-3);
  }
  EXPECT_EQ(world.counters.islands_at_rest, 0u);
  world.states[0].linear_velocity_m_s = Vec3::Zero();
  world.run(240, geometry);
  const std::uint64_t before = world.counters.islands_at_rest;
  world.run(10, geometry);
  EXPECT_EQ(world.counters.islands_at_rest, before + 10);
}

// Friction drags a box along until it has the platform's speed: after u / (mu g).
TEST(Kinematic, DragsByFriction) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / 240.0;
  const Material rough{0.4, 0.0};
  add_kinematic(world, box_of(5, 1, 0.1), Vec3::Zero(), rough).linear_velocity_m_s = Vec3(1, 0, 0);
  world.add_body(world.add_shape(box_of(0.3, 0.3, 0.1)), Vec3(0, 0, 0.2), 1000.0, rough);
  const double grip_s = 1.0 / (0.4 * kGravity);
  const int steps = 120;
  world.run(steps);
  const double expected = 0.5 * grip_s + (steps * world.scene.dt_s - grip_s);
  EXPECT_NEAR(world.states[1].linear_velocity_m_s.x(), 1.0, 1e-6);
  EXPECT_NEAR(world.states[1].position_m.x(), expected, 1.0 * world.scene.dt_s);
}

// Boxes on a disc, and how far from its axis they start.
World turntable(double steps_per_s, double angular_speed_rad_s, std::span<const double> radii_m) {
  World world = test::under_gravity();
  world.scene.dt_s = 1.0 / steps_per_s;
  const Material rough{0.8, 0.0};
  add_kinematic(world, Cylinder{2.5, 0.2}, Vec3::Zero(), rough).angular_velocity_rad_s =
      Vec3(0, 0, angular_speed_rad_s);
  const std::uint32_t box = world.add_shape(box_of(0.1, 0.1, 0.1));
  for (std::size_t i = 0; i < radii_m.size(); ++i) {
    const double angle = 2.4 * static_cast<double>(i);
    const Vec3 arm(radii_m[i] * std::cos(angle), radii_m[i] * std::sin(angle), 0.2);
    BodyState& state = world.add_body(box, arm, 1000.0, rough);
    state.angular_velocity_rad_s = Vec3(0, 0, angular_speed_rad_s);
    state.linear_velocity_m_s = state.angular_velocity_rad_s.cross(arm);
  }
  return world;
}

double distance_from_axis_m(const Vec3& place) { return std::hypot(place.x(), place.y()); }

// One is solved iteratively, few directly or in substeps: what sticks keeps its place on the disc.
TEST(Kinematic, TurnsWhatRidesOnItInACircle) {
  const std::vector<double> all{0.4, 0.8, 1.2, 1.6, 2.0};
  for (const std::size_t count : {1u, 2u, 5u})
    for (const bool direct : {true, false})
      for (const double steps_per_s : {30.0, 60.0, 240.0})
        for (const double angular_speed : {0.3, 1.0, 1.8}) {
          const std::span<const double> radii(all.data() + all.size() - count, count);
          World world = turntable(steps_per_s, angular_speed, radii);
          world.scene.solver.direct = direct;
          world.run(static_cast<int>(3.0 * steps_per_s));
          for (std::size_t i = 0; i < count; ++i) {
            const double along_tangents_m =
                1.5 * angular_speed * angular_speed * radii[i] / steps_per_s;
            EXPECT_NEAR(distance_from_axis_m(world.states[i + 1].position_m), radii[i],
                        1e-4 + 0.02 * along_tangents_m)
                << count << " " << direct << " " << steps_per_s << " " << angular_speed << " " << i;
          }
        }
}

// The square of such an angular velocity is nothing.
TEST(Kinematic, CarriesWhatIsOnItHoweverSlowlyItTurns) {
  for (const double angular_speed : {1e-200, 1e-100, 1e-12}) {
    const std::vector<double> radii{1.0, 2.0};
    World world = turntable(60.0, angular_speed, radii);
    world.run(60);
    ASSERT_TRUE(world.report.faults.empty()) << angular_speed;
    for (std::size_t i = 0; i < radii.size(); ++i)
      EXPECT_NEAR(distance_from_axis_m(world.states[i + 1].position_m), radii[i], 1e-4)
          << angular_speed;
  }
}

TEST(Kinematic, PassesThroughStaticsAndItsKind) {
  World world;
  world.add_floor();
  add_kinematic(world, box_of(1, 1, 1), Vec3::Zero()).linear_velocity_m_s = Vec3(0, 0, -1);
  add_kinematic(world, box_of(1, 1, 1), Vec3(0.5, 0, 0));
  world.run(30);
  EXPECT_EQ(world.counters.manifolds, 0u);
  EXPECT_EQ(world.counters.kinematic_bodies, 60u);
}

TEST(Kinematic, IsNotPushed) {
  World world;
  add_kinematic(world, box_of(1, 1, 1), Vec3::Zero());
  push(world.scene.bodies[0], Vec3(5, 0, 0), Vec3(0, 1, 0), world.states[0]);
  EXPECT_TRUE(moves_alike(world.states[0], BodyState{}));
}

// Lifted from beneath, carried aside, and stopped.
TEST(Kinematic, CarriesWhatJointsHoldTogether) {
  for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
    World world = test::under_gravity();
    world.scene.dt_s = dt;
    add_kinematic(world, box_of(3, 1, 0.1), Vec3::Zero(), {0.8, 0.0});
    const std::uint32_t box = world.add_shape(box_of(0.2, 0.1, 0.1));
    constexpr std::uint32_t kLinks = 6;
    for (std::uint32_t i = 0; i < kLinks; ++i) {
      world.add_body(box, Vec3(0.5 * i - 1.25, 0, 0.3), 1000.0, {0.8, 0.0});
      if (i > 0)
        test::add(world,
                  test::joint_at(JointKind::kBall, world, i, i + 1, Vec3(0.5 * i - 1.5, 0, 0.3)));
    }
    const Geometry geometry(world.scene);
    for (const Vec3& velocity : {Vec3(0, 0, 1), Vec3(0, 0, 0), Vec3(0.5, 0, 0), Vec3(0, 0, 0)}) {
      world.states[0].linear_velocity_m_s = velocity;
      world.run(static_cast<int>(1.0 / dt + 0.5), geometry);
      EXPECT_TRUE(world.report.faults.empty());
      for (std::uint32_t i = 1; i <= kLinks; ++i) {
        const Vec3 from = world.states[i].position_m - world.states[0].position_m;
        EXPECT_NEAR(from.z(), 0.2, 2e-3) << dt << " link " << i;
        EXPECT_NEAR(from.x(), 0.5 * i - 1.75, 0.025) << dt << " link " << i;
      }
    }
  }
}

// A game of 54 blocks, of which one is pushed out at 3 cm/s. The first eight substeps let them sink
// in by a fifth of their height, and the factorisations that followed took 50 ms a step.
TEST(Kinematic, WhatIsPushedOutOfATowerLeavesItWhole) {
  constexpr double kLong = 0.075, kWide = 0.025, kHigh = 0.015;
  const Material wood{.friction = 0.4, .restitution = 0.1};
  World world = test::under_gravity();
  world.add_floor(wood);
  const std::uint32_t along = world.add_shape(box_of(kLong / 2, kWide / 2, kHigh / 2)),
                      across = world.add_shape(box_of(kWide / 2, kLong / 2, kHigh / 2));
  for (int layer = 0; layer < 18; ++layer)
    for (int i = -1; i <= 1; ++i) {
      const double high = (layer + 0.5) * kHigh;
      if (layer % 2 == 1)
        world.add_body(along, Vec3(0, i * kWide, high), 700.0, wood);
      else
        world.add_body(across, Vec3(i * kWide, 0, high), 700.0, wood);
    }
  add_kinematic(world, box_of(0.03, 0.004, 0.004), Vec3(-0.0676, 0, 7.5 * kHigh), wood)
      .linear_velocity_m_s = Vec3(0.03, 0, 0);
  double deepest_m = 0.0;
  for (int step = 0; step < 60; ++step) {
    world.run(1);
    for (const IslandReport& island : world.report.islands)
      deepest_m = std::max(deepest_m, island.max_penetration_m);
  }
  EXPECT_LE(deepest_m, 0.02 * kHigh);
  EXPECT_LE(world.counters.factor_multiplications, 60 * 4'000'000u);
}

}  // namespace
}  // namespace soda::physics
