// The direct solution of joints: its pattern, and what it does to bodies.
#include "physics/constraints/joint_elimination.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "tests/physics/joints.hpp"

namespace soda::physics {
namespace {

using test::joint_at;
using test::World;

constexpr double kAnyWork = 1e300;

double multiplications_of(std::span<const JointEnds> ends) {
  std::vector<std::uint32_t> first_row;
  for (std::uint32_t joint = 0; joint <= ends.size(); ++joint) first_row.push_back(3 * joint);
  return plan_joint_elimination(ends, first_row, kAnyWork)->multiplications;
}

struct Shape {
  const char* name;
  std::uint32_t (*holder)(std::uint32_t body);  // of each body but the first
};

constexpr Shape kShapes[] = {
    {"chain", [](std::uint32_t body) { return body - 1; }},
    {"star", [](std::uint32_t) { return 0u; }},
    {"binary tree", [](std::uint32_t body) { return (body - 1) / 2; }},
    {"tree of hubs", [](std::uint32_t body) { return (body - 1) / 20; }},
    {"comb", [](std::uint32_t body) { return body % 10 == 0 ? body - 10 : body - 1; }},
};

TEST(JointElimination, OfATreeOfAnyFormTakesTheSameWorkForEachJoint) {
  for (const auto& [name, holder] : kShapes)
    for (const bool of_world : {false, true}) {
      const auto of = [&](std::uint32_t bodies) {
        std::vector<JointEnds> ends;
        if (of_world) ends.push_back({0, kImmovable});
        for (std::uint32_t body = 1; body < bodies; ++body) ends.push_back({body, holder(body)});
        return multiplications_of(ends) / static_cast<double>(ends.size());
      };
      EXPECT_LT(of(2000), 1.2 * of(200)) << name << ", " << of_world;
      EXPECT_LT(of(2000), 400.0) << name << ", " << of_world;
    }
}

TEST(JointElimination, IsGivenUpBeyondTheWorkThatIsAskedFor) {
  const std::vector<JointEnds> ends{{0, 1}, {1, 2}, {2, kImmovable}};
  const std::vector<std::uint32_t> first_row{0, 3, 6, 9};
  const double work = plan_joint_elimination(ends, first_row, kAnyWork)->multiplications;
  EXPECT_TRUE(plan_joint_elimination(ends, first_row, 1.001 * work));
  EXPECT_FALSE(plan_joint_elimination(ends, first_row, 0.999 * work));
}

// Bodies, some of them kinematic, with joints of all kinds that make trees and loops, lead to the
// world, and hold two bodies twice. The first two bodies have
// many arms.
World any_joints(std::mt19937_64& random, std::uint32_t bodies) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto below = [&random](std::uint32_t n) {
    return static_cast<std::uint32_t>(random() % n);
  };
  World world;
  const std::uint32_t box = world.add_shape(Box{{0.2, 0.3, 0.1}});
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const Vec3 place(unit(random), unit(random), unit(random));
    BodyState& state = world.add_body(box, place, 500.0 * (1.5 + unit(random)));
    state.linear_velocity_m_s = Vec3(unit(random), unit(random), unit(random));
    state.angular_velocity_rad_s = Vec3(unit(random), unit(random), unit(random));
  }
  if (bodies > 20) {
    world.scene.bodies[10].kinematic = true;
    world.scene.bodies[10].inverse_inertia_local = Mat3::Zero();
  }
  constexpr JointKind kKinds[] = {JointKind::kBall, JointKind::kHinge, JointKind::kDistance,
                                  JointKind::kFixed, JointKind::kSlider};
  const auto hold = [&](JointKind kind, std::uint32_t a, std::optional<std::uint32_t> b) {
    const Vec3 axis = Vec3(unit(random), unit(random), 1.5).normalized();
    Joint joint = joint_at(kind, world, a, b, Vec3(unit(random), unit(random), unit(random)), axis);
    if (joint.kind == JointKind::kDistance) joint.anchor_b_m += Vec3(0.1, 0.2, 0.3);
    test::add(world, joint);
  };
  for (std::uint32_t i = 1; i < bodies; ++i)
    if (below(8) > 0) hold(kKinds[below(5)], below(3) == 0 ? below(i) : below(std::min(i, 2u)), i);
  for (std::uint32_t i = 0; i < bodies / 8; ++i) {
    const std::uint32_t a = below(bodies), b = below(bodies);
    if (a != b) hold(JointKind::kDistance, std::min(a, b), std::max(a, b));
    if (below(2) == 0 && a != 10) hold(JointKind::kDistance, a, std::nullopt);
  }
  return world;
}

JointSystem joints_of(const World& world) {
  std::vector<ContactManifold> manifolds;
  for (std::size_t i = 0; i < world.scene.joints.size(); ++i) {
    const Joint& joint = world.scene.joints[i];
    const bool again =
        i > 0 && world.scene.joints[i - 1].a == joint.a && world.scene.joints[i - 1].b == joint.b;
    if (!is_static(joint.b) && !again)
      append_joints(world.scene, joint.a, world.states[index_of(joint.a)], joint.b, manifolds);
  }
  append_world_joints(world.scene, world.ids, world.states, manifolds);
  JointSystem system = find_joints(world.scene, world.ids, manifolds);
  build_joint_rows(world.scene, 0.1, world.states, false, system);
  return system;
}

TEST(JointElimination, LeavesNoVelocityThatJointsDoNotAllowWhateverHangsOnWhat) {
  std::mt19937_64 random(3);
  std::size_t with_hubs = 0, with_several = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const World world = any_joints(random, 2 + static_cast<std::uint32_t>(random() % 60));
    JointSystem system = joints_of(world);
    if (system.empty()) continue;
    std::vector<SolverBody> bodies(world.ids.size() + 1);
    for (std::size_t i = 0; i < world.ids.size(); ++i) {
      bodies[i] = solver_body(world.scene.bodies[i], world.states[i]);
      if (bodies[i].inverse_mass == 0.0) bodies[i].linear = bodies[i].angular = Vec3::Zero();
    }
    const auto momentum_of = [&] {
      Vec3 sum = Vec3::Zero();
      for (const SolverBody& body : bodies)
        if (body.inverse_mass > 0.0) sum += body.linear / body.inverse_mass;
      return sum;
    };
    const Vec3 momentum = momentum_of();
    factor_joint_rows(bodies, system);
    solve_joint_velocities(system, bodies);
    const std::vector<std::uint32_t>& hubs = system.elimination->hubs;
    with_hubs += !hubs.empty();
    with_several += hubs.size() > 1;
    Vec3 given = Vec3::Zero();
    for (const JointRow& row : system.rows) {
      ASSERT_NEAR(velocity_of(row, bodies) / row.lever_m, 0.0, 1e-7)
          << trial << ", joint " << row.a << row.b;
      const bool from_outside = row.b == world.ids.size() || bodies[row.a].inverse_mass == 0.0 ||
                                bodies[row.b].inverse_mass == 0.0;
      if (!from_outside) continue;
      if (bodies[row.a].inverse_mass > 0.0) given -= row.linear * row.impulse_newton_s;
      if (bodies[row.b].inverse_mass > 0.0) given += row.linear * row.impulse_newton_s;
    }
    EXPECT_LT((momentum_of() - momentum - given).norm(),
              1e-7 * (momentum.norm() + given.norm() + 1.0))
        << trial;
  }
  EXPECT_GT(with_hubs, 100u);
  EXPECT_GT(with_several, 10u);
}

// What it took the cube of the arms for, and from 81 on was swept: the hub lost half of its energy.
TEST(JointElimination, HoldsAStarOfAnyNumberOfArms) {
  for (const std::uint32_t arms : {5u, 6u, 7u, 50u, 200u, 800u}) {
    World world = test::under_gravity();
    const std::uint32_t ball = world.add_shape(Sphere{0.1}), rod = world.add_shape(Sphere{0.001});
    world.add_body(ball, Vec3::Zero(), 1000.0);
    for (std::uint32_t i = 0; i < arms; ++i) {
      const double angle = 2.0 * M_PI * i / arms;
      const Vec3 out(std::cos(angle), std::sin(angle), 0.0);
      world.add_body(rod, out, 1000.0);
      test::add(world, joint_at(JointKind::kBall, world, 0, i + 1, 0.1 * out));
    }
    const auto joule = [&world] {
      return world.mechanics().kinetic_energy_joule + world.mechanics().potential_energy_joule;
    };
    world.states[0].linear_velocity_m_s = Vec3(1, 0, 2);
    world.run(1);  // it starts off with a jerk
    const double before = joule();
    world.run(4);
    EXPECT_LT(test::largest_gap_m(world), 1e-12) << arms;
    EXPECT_NEAR(joule(), before, 1e-6 * std::abs(before)) << arms;
    EXPECT_EQ(world.counters.joint_sweeps, 0u) << arms;
  }
}

// It needs no matrix, so nothing had planned one when its parts were counted.
TEST(JointElimination, IsThereForABodyThatSpinsFastOnABallJointInAccuracyMode) {
  World world = test::under_gravity();
  world.scene.tolerance = 1e-12;
  world.add_body(world.add_shape(Box{{0.2, 0.05, 0.05}}), Vec3(0.2, 0, 3)).angular_velocity_rad_s =
      Vec3(300, 200, 5);
  test::add(world, joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3(0, 0, 3)));
  world.run(20);
  EXPECT_TRUE(world.report.faults.empty());
  EXPECT_LT(test::largest_gap_m(world), 1e-9);
}

}  // namespace
}  // namespace soda::physics
