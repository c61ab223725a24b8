// What steps of islands with joints give in energy: nothing but the work that they report.
#include <gtest/gtest.h>

#include <cmath>

#include "physics/measures/measures.hpp"
#include "physics/model/joint.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::joint_at;
using test::kGravity;
using test::World;

double energy(const World& world) {
  const Mechanics m = world.mechanics();
  return m.kinetic_energy_joule + m.potential_energy_joule;
}

struct Works {
  double pushed_out = 0.0, motors = 0.0;
};
Works works(const World& world) {
  Works sum;
  for (const IslandReport& island : world.report.islands) {
    sum.pushed_out += island.push_out_work_joule;
    sum.motors += island.motor_work_joule;
  }
  return sum;
}

// Steps, each of which gives no more than it reports; `scale`: of the energies.
void expect_no_gain(World& world, int steps, double scale) {
  const Geometry geometry(world.scene);
  for (int i = 0; i < steps; ++i) {
    const double before = energy(world);
    world.run(1, geometry);
    ASSERT_TRUE(world.report.faults.empty()) << "step " << i;
    const Works work = works(world);
    ASSERT_LE(energy(world) - before - work.pushed_out - work.motors, 1e-12 * scale)
        << "step " << i;
  }
}

// Links of unit length from the origin along x, each on the one before by a ball joint.
World chain_of(int links, double last_density) {
  World world = test::under_gravity();
  const std::uint32_t link = world.add_shape(Box{Vec3(0.45, 0.1, 0.1)});
  for (int i = 0; i < links; ++i)
    world.add_body(link, Vec3(i + 0.5, 0, 0), i + 1 < links ? 1000.0 : last_density);
  for (int i = 0; i + 1 < links; ++i)
    add(world, joint_at(JointKind::kBall, world, i, i + 1, Vec3(i + 1, 0, 0)));
  return world;
}

TEST(JointEnergy, AnArticulatedIslandKeepsItToRoundingThoughLinksRotateFast) {
  World world = chain_of(2, 50.0);
  add(world, joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  const double start = energy(world), scale = world.scene.bodies[0].mass_kg * kGravity;
  world.run(1200);
  EXPECT_NEAR(energy(world), start, 1e-9 * scale);
}

TEST(JointEnergy, AChainThatIsDraggedOverAFloorGainsNone) {
  World world = chain_of(5, 1000.0);
  world.add_static(world.add_shape(HalfSpace{}), Vec3(0, 0, -1.2), Quat::Identity(),
                   Material{.friction = 0.5});
  add(world, joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  expect_no_gain(world, 600, 5 * world.scene.bodies[0].mass_kg * kGravity);
}

TEST(JointEnergy, ALoopThatIsHeldTwiceBesideContactsGainsNone) {
  for (const double density : {1.0, 1e3, 1e9}) {
    World world = chain_of(4, density);
    world.add_static(world.add_shape(HalfSpace{}), Vec3(0, 0, -0.3));
    add(world, joint_at(JointKind::kDistance, world, 0, 3, Vec3(0.5, 0, 0)));
    for (Joint& joint : world.scene.joints)
      if (joint.kind == JointKind::kDistance) {
        joint.anchor_a_m = joint.anchor_b_m = Vec3::Zero();
        joint.length_m = 3.0;
      }
    add(world, joint_at(JointKind::kFixed, world, 1, 2, Vec3(2, 0, 0)));
    world.states[0].linear_velocity_m_s = Vec3(0, 3, -5);
    double mass = 0.0;
    for (const BodyParams& body : world.scene.bodies) mass += body.mass_kg;
    expect_no_gain(world, 240, mass * kGravity);
  }
}

TEST(JointEnergy, ParallelSlidersThatBounceBesideEachOtherGainNone) {
  World world = test::under_gravity();
  world.add_floor(Material{.restitution = 1.0});
  const std::uint32_t box = world.add_shape(Box{Vec3(0.1, 0.1, 0.1)});
  for (int i = 0; i < 4; ++i) {
    world.add_body(box, Vec3(0.2 * i, 0, 0.3 + 0.1 * i), i % 2 ? 1e6 : 1.0,
                   Material{.restitution = 1.0});
    add(world,
        joint_at(JointKind::kSlider, world, i, std::nullopt, Vec3(0.2 * i, 0, 1), Vec3(0.1, 0, 1)));
  }
  expect_no_gain(world, 300, 2e4 * kGravity);
}

TEST(JointEnergy, MotorsReportAllThatTheyGive) {
  World world = test::under_gravity();
  world.add_body(world.add_shape(Box{Vec3(0.5, 0.1, 0.1)}), Vec3(0.5, 0, 0));
  add(world, joint_at(JointKind::kHinge, world, 0, std::nullopt, Vec3::Zero(), Vec3::UnitY()))
      .motor = JointMotor{-4.0, 5e3};
  const double start = energy(world);
  double given = 0.0;
  for (int i = 0; i < 120; ++i) {
    world.run(1);
    given += works(world).motors;
  }
  EXPECT_GT(std::abs(given), 50.0);
  EXPECT_NEAR(energy(world) - start, given, 1e-9 * std::abs(given));
}

// A weight on a light foot: the floor has to carry a million times what touches it.
TEST(JointEnergy, AFootCarriesWhatIsAMillionTimesHeavier) {
  World world = test::under_gravity();
  world.add_floor();
  world.add_body(world.add_shape(Box{Vec3(0.1, 0.1, 0.1)}), Vec3(0, 0, 0.1), 1e-3);
  world.add_body(world.add_shape(Box{Vec3(0.1, 0.1, 0.1)}), Vec3(0, 0, 0.5), 1e3);
  add(world, joint_at(JointKind::kFixed, world, 0, 1, Vec3(0, 0, 0.3)));
  world.run(600);
  EXPECT_NEAR(world.states[0].position_m.z(), 0.1, 1e-4);
  EXPECT_NEAR(world.states[1].position_m.z(), 0.5, 1e-4);
  EXPECT_NEAR(works(world).pushed_out, 0.0, 1e-6);
}

}  // namespace
}  // namespace soda::physics
