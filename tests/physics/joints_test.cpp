// Joints: that they hold, what they keep, and what they cost to get right.
#include "tests/physics/joints.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "physics/measures/measures.hpp"
#include "physics/model/joint.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::joint_at;
using test::kGravity;
using test::World;

// Of a joint, in the world frame: where its ends are.
Vec3 gap(const World& world, const Joint& joint) {
  const BodyState& a = world.states[index_of(joint.a)];
  const Vec3 at_a = a.position_m + a.orientation * joint.anchor_a_m;
  if (joint.b == kWorldBody) return joint.anchor_b_m - at_a;
  const BodyState& b = world.states[index_of(joint.b)];
  return b.position_m + b.orientation * joint.anchor_b_m - at_a;
}

double energy(const World& world) {
  const Mechanics m = measure(world.scene, world.ids, world.states);
  return m.kinetic_energy_joule + m.potential_energy_joule;
}

// A sphere of radius r on a massless rod of length 1, released at an angle.
World pendulum(double angle, double dt_s, double radius_m = 0.1) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  world.scene.dt_s = dt_s;
  const Vec3 at(std::sin(angle), 0, -std::cos(angle));
  world.add_body(world.add_shape(Sphere{radius_m}), at);
  add(world, joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  return world;
}

double angle_of(const World& world) {
  const Vec3& at = world.states[0].position_m;
  return std::atan2(at.x(), -at.z());
}

// theta'' = -w^2 sin(theta), by Runge-Kutta with steps a thousand times smaller than asked for.
double swung(double angle, double squared_rate, double time_s) {
  const int steps = 20000;
  const double h = time_s / steps;
  double x = angle, v = 0.0;
  const auto pull = [squared_rate](double a) { return -squared_rate * std::sin(a); };
  for (int i = 0; i < steps; ++i) {
    const double k1 = v, l1 = pull(x), k2 = v + h / 2 * l1, l2 = pull(x + h / 2 * k1);
    const double k3 = v + h / 2 * l2, l3 = pull(x + h / 2 * k2), k4 = v + h * l3;
    const double l4 = pull(x + h * k3);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    v += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
  }
  return x;
}

TEST(Joints, APendulumSwingsAsItsEquationSaysToFourthOrder) {
  // Moment about the pivot over mass: 1 + 2/5 r^2.
  const double squared_rate = kGravity / (1.0 + 0.4 * 0.01);
  const double expected = swung(1.0, squared_rate, 2.0);
  double coarse = 0.0;
  for (const int per_second : {60, 120, 240}) {
    World world = pendulum(1.0, 1.0 / per_second);
    world.run(2 * per_second);
    const double error = std::abs(angle_of(world) - expected);
    EXPECT_LT(error, 3e-7 * std::pow(60.0 / per_second, 4));
    if (coarse > 0.0) {
      // Keeping the energy is not symmetric in time: odd powers of the step follow the fourth.
      EXPECT_NEAR(coarse / error, 16.0, 0.3) << per_second;
    }
    coarse = error;
    EXPECT_LT(gap(world, world.scene.joints[0]).norm(), 1e-13);
  }
}

TEST(Joints, APendulumKeepsItsEnergyForAMinute) {
  World world = pendulum(2.0, 1.0 / 60);
  const double start = energy(world), scale = world.scene.bodies[0].mass_kg * kGravity * 2.0;
  double worst = 0.0;
  for (int i = 0; i < 3600; ++i) {
    world.run(1);
    worst = std::max(worst, std::abs(energy(world) - start) / scale);
  }
  EXPECT_LT(worst, 1e-6);
}

// Chaotic: no point of it can be checked but that it holds and keeps its energy.
TEST(Joints, ADoublePendulumOfCapsulesKeepsItsEnergyForTwentySeconds) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  const std::uint32_t capsule = world.add_shape(Capsule{0.1, 1.0});
  const Quat level(Eigen::AngleAxisd(0.5 * M_PI, Vec3::UnitY()));
  world.add_body(capsule, Vec3(0.6, 0, 0)).orientation = level;
  world.add_body(capsule, Vec3(1.8, 0, 0)).orientation = level;
  add(world, joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  add(world, joint_at(JointKind::kBall, world, 0, 1, Vec3(1.2, 0, 0)));
  const double start = energy(world);
  const double scale = 2.0 * world.scene.bodies[0].mass_kg * kGravity * 2.4;
  for (int i = 0; i < 1200; ++i) {
    world.run(1);
    ASSERT_TRUE(world.report.faults.empty()) << "step " << i;
    ASSERT_NEAR(energy(world), start, 1e-2 * scale) << "step " << i;
    for (const Joint& joint : world.scene.joints)
      ASSERT_LT(gap(world, joint).norm(), 1e-12) << "step " << i;
  }
}

// cases.md's chain: the must is a gap of 1e-6 m.
TEST(Joints, AChainOfAHundredLinksHoldsAHundredTimesItsLinksMass) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  const std::uint32_t link = world.add_shape(Box{Vec3(0.05, 0.05, 0.1)});
  const std::uint32_t weight = world.add_shape(Sphere{0.3});
  for (int i = 0; i < 100; ++i) world.add_body(link, Vec3(0, 0, -0.1 - 0.2 * i), 500.0);
  world.add_body(weight, Vec3(0, 0, -20.3));
  BodyParams& heavy = world.scene.bodies.back();
  const double scale = 100.0 / heavy.mass_kg;
  heavy.mass_kg *= scale;
  heavy.inertia_local_kg_m2 *= scale;
  heavy.inverse_inertia_local /= scale;
  ASSERT_NEAR(world.scene.bodies[0].mass_kg, 1.0, 1e-12);
  add(world, joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  for (std::uint32_t i = 0; i < 100; ++i)
    add(world, joint_at(JointKind::kBall, world, i, i + 1, Vec3(0, 0, -0.2 * (i + 1.0))));
  world.states.back().linear_velocity_m_s = Vec3(2, 1, 0);
  double worst = 0.0;
  for (int i = 0; i < 600; ++i) {
    world.run(1);
    for (const Joint& joint : world.scene.joints) worst = std::max(worst, gap(world, joint).norm());
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_TRUE(world.report.faults.empty());
}

TEST(Joints, LinkedBodiesKeepMomentumAndAngularMomentum) {
  for (const JointKind kind : {JointKind::kBall, JointKind::kHinge, JointKind::kSlider,
                               JointKind::kFixed, JointKind::kDistance}) {
    World world;
    const std::uint32_t box = world.add_shape(Box{Vec3(0.3, 0.2, 0.1)});
    world.add_body(box, Vec3(0, 0, 0)).angular_velocity_rad_s = Vec3(1, 2, 3);
    world.add_body(box, Vec3(1, 0, 0)).linear_velocity_m_s = Vec3(0, 1, 0.5);
    Joint joint = joint_at(kind, world, 0, 1, Vec3(0.5, 0, 0), Vec3(1, 2, 2).normalized());
    if (kind == JointKind::kDistance) {
      joint.anchor_a_m = joint.anchor_b_m = Vec3::Zero();
      joint.length_m = joint.reach_m = 1.0;
    }
    add(world, joint);
    world.run(1);  // after it, the velocities are ones that the joint allows
    const Mechanics start = measure(world.scene, world.ids, world.states);
    world.run(600);
    const Mechanics end = measure(world.scene, world.ids, world.states);
    const double scale = start.angular_momentum_newton_m_s.norm();
    EXPECT_LT((end.linear_momentum_newton_s - start.linear_momentum_newton_s).norm(),
              1e-11 * start.momentum_scale_newton_s);
    EXPECT_LT((end.angular_momentum_newton_m_s - start.angular_momentum_newton_m_s).norm(),
              1e-9 * scale)
        << static_cast<int>(kind);
    EXPECT_NEAR(end.kinetic_energy_joule / start.kinetic_energy_joule, 1.0, 2e-3)
        << static_cast<int>(kind);
  }
}

TEST(Joints, AHingeTurnsAboutItsAxisOnlyAndASliderDoesNotTurn) {
  for (const JointKind kind : {JointKind::kHinge, JointKind::kSlider}) {
    World world;
    world.scene.gravity_m_s2 = Vec3(0, 3, -kGravity);
    world.add_body(world.add_shape(Box{Vec3(0.3, 0.2, 0.1)}), Vec3(0.5, 0, 0));
    const Vec3 axis = Vec3(1, 1, 0).normalized();
    add(world, joint_at(kind, world, 0, std::nullopt, Vec3::Zero(), axis));
    world.run(30);
    const BodyState& state = world.states[0];
    if (kind == JointKind::kHinge) {
      EXPECT_LT((state.orientation * axis - axis).norm(), 1e-13);
      EXPECT_LT(state.angular_velocity_rad_s.cross(axis).norm(), 1e-12);
      EXPECT_GT(state.angular_velocity_rad_s.norm(), 1.0);
    } else {
      EXPECT_LT(state.angular_velocity_rad_s.norm(), 1e-12);
      // Down the axis under the part of gravity along it, from rest, exactly.
      const double along = world.scene.gravity_m_s2.dot(axis);
      EXPECT_LT((state.position_m - Vec3(0.5, 0, 0) - axis * (0.5 * along * 0.25)).norm(), 1e-12);
    }
  }
}

TEST(Joints, SpringsOfAnyStiffnessAreStableAndComeToRestWhereTheyMust) {
  for (const double stiffness : {1e2, 1e5, 1e9}) {
    for (const double damping_ratio : {0.0, 0.1, 1.0}) {
      World world;
      world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
      world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, -1.0));
      const double mass = world.scene.bodies[0].mass_kg;
      Joint joint = joint_at(JointKind::kSpring, world, 0, std::nullopt, Vec3(0, 0, 0));
      joint.anchor_a_m = Vec3::Zero();
      joint.length_m = 0.9;
      joint.stiffness_newton_m = stiffness;
      joint.damping_newton_s_m = damping_ratio * 2.0 * std::sqrt(stiffness * mass);
      add(world, joint);
      const double start = energy(world);
      for (int i = 0; i < 3600; ++i) {
        world.run(1);
        ASSERT_LE(energy(world), start + 1e-9 * std::abs(start));
      }
      if (damping_ratio == 0.0) continue;
      const double rest = -joint.length_m - mass * kGravity / stiffness;
      EXPECT_NEAR(world.states[0].position_m.z(), rest, 1e-6) << stiffness;
    }
  }
}

// Joints that contradict each other as soon as anything moves: no energy may come of it.
TEST(Joints, ATautChainBetweenTwoWallsThatIsHitGainsNoEnergy) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  const std::uint32_t plank = world.add_shape(Box{Vec3(0.45, 0.8, 0.05)});
  for (int i = 0; i < 8; ++i) world.add_body(plank, Vec3(i, 0, 0), 600.0);
  world.add_body(world.add_shape(Box{Vec3(0.3, 0.3, 0.3)}), Vec3(3.2, 0.1, 1.5));
  const auto hinge = [&](std::uint32_t a, std::optional<std::uint32_t> b, double x) {
    add(world, joint_at(JointKind::kHinge, world, a, b, Vec3(x, 0, 0), Vec3::UnitY()));
  };
  hinge(0, std::nullopt, -0.5);
  for (std::uint32_t i = 0; i < 7; ++i) hinge(i, i + 1, i + 0.5);
  hinge(7, std::nullopt, 7.5);
  const double start = energy(world);
  for (int i = 0; i < 600; ++i) {
    world.run(1);
    ASSERT_TRUE(world.report.faults.empty()) << "step " << i;
    ASSERT_LE(energy(world), start + 1e-6 * std::abs(start)) << "step " << i;
  }
}

TEST(Joints, ABodyOutOfReachOfItsJointIsAFault) {
  World world;
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_body(ball, Vec3(0, 0, 0));
  world.add_body(ball, Vec3(1, 0, 0));
  add(world, joint_at(JointKind::kBall, world, 0, 1, Vec3(0.5, 0, 0))).reach_m = 0.1;
  world.states[1].position_m.x() = 3.0;
  world.run(1);
  ASSERT_EQ(world.report.faults.size(), 2u);
  EXPECT_NE(world.report.faults[0].what.find("joint"), std::string::npos);
}

TEST(Joints, AHingedPlankOnTheGroundHoldsBesideItsContacts) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  world.add_floor();
  const std::uint32_t plank = world.add_shape(Box{Vec3(0.5, 0.2, 0.05)});
  world.add_body(plank, Vec3(-0.55, 0, 0.05));
  world.add_body(plank, Vec3(0.55, 0, 0.6));
  world.states[1].orientation = Quat(Eigen::AngleAxisd(-0.785, Vec3::UnitY()));
  world.states[1].position_m = Vec3(0, 0, 0.05) + world.states[1].orientation * Vec3(0.55, 0, 0);
  add(world, joint_at(JointKind::kHinge, world, 0, 1, Vec3(0, 0, 0.05), Vec3::UnitY()));
  world.run(300);
  EXPECT_LT(gap(world, world.scene.joints[0]).norm(), 1e-12);
  EXPECT_LT(world.states[1].angular_velocity_rad_s.norm(), 1e-3) << "it lies on the ground";
  EXPECT_NEAR(world.states[1].position_m.z(), 0.05, 1e-3);
}

}  // namespace
}  // namespace soda::physics
