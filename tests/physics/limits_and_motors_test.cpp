// Limits and motors of joints: what they do, what they keep, and what they may not do.
#include "physics/constraints/limits_and_motors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "physics/math/rigid_motion.hpp"
#include "physics/model/joint.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::joint_at;
using test::kGravity;
using test::World;

World lift(double target, double force, double dt_s) {
  World world = test::under_gravity();
  world.scene.dt_s = dt_s;
  world.add_body(world.add_shape(Box{{0.2, 0.2, 0.2}}), Vec3::Zero(), 10.0 / 0.064);
  // The world against the body: the other way round.
  add(world, joint_at(JointKind::kSlider, world, 0, std::nullopt, Vec3::Zero(), Vec3::UnitZ()))
      .motor = JointMotor{-target, force};
  return world;
}

TEST(Motors, PushEvenlyUpToTheirSpeedAndKeepIt) {
  for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
    World world = lift(0.5, 10.0 * (kGravity + 1.0), dt);
    world.run(static_cast<int>(0.5 / dt + 0.5));
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.z(), 0.5, 1e-12);
    EXPECT_NEAR(world.states[0].position_m.z(), 0.125, 1e-12);
    world.run(static_cast<int>(1.0 / dt + 0.5));
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.z(), 0.5, 1e-12);
    EXPECT_NEAR(world.states[0].position_m.z(), 0.625, 1e-12);
  }
}

TEST(Motors, GiveWayToWhatIsStronger) {
  World world = lift(0.5, 50.0, 1.0 / 60);
  world.run(60);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.z(), 5.0 - kGravity, 1e-12);
  EXPECT_NEAR(world.states[0].position_m.z(), 0.5 * (5.0 - kGravity), 1e-12);
}

TEST(Motors, BetweenTwoBodiesKeepMomentumAndAngularMomentum) {
  for (const JointKind kind : {JointKind::kHinge, JointKind::kSlider}) {
    World world;
    const std::uint32_t box = world.add_shape(Box{{0.5, 0.2, 0.1}});
    world.add_body(box, Vec3(0, 0, 0)).linear_velocity_m_s = Vec3(1, 0.5, 0);
    world.add_body(box, Vec3(0.7, 0.1, 0.3), 300.0).linear_velocity_m_s = Vec3(1, 0.5, 0);
    add(world, joint_at(kind, world, 0, 1, Vec3(0.4, 0, 0.1), Vec3(0.2, 0.3, 1).normalized()))
        .motor = JointMotor{2.0, 40.0};
    const Mechanics before = world.mechanics();
    world.run(120);
    const Mechanics after = world.mechanics();
    EXPECT_LT((after.linear_momentum_newton_s - before.linear_momentum_newton_s).norm(),
              1e-12 * before.momentum_scale_newton_s);
    EXPECT_LT((after.angular_momentum_newton_m_s - before.angular_momentum_newton_m_s).norm(),
              1e-11 * before.momentum_scale_newton_s);
    EXPECT_GT(after.kinetic_energy_joule, before.kinetic_energy_joule + 1.0);
  }
}

// A motor in a closed loop with contacts: first order, but it holds its speed.
TEST(Motors, DriveACartOnWheelsOverTheGround) {
  World world = test::under_gravity();
  world.add_floor();
  world.add_body(world.add_shape(Box{{0.6, 0.3, 0.1}}), Vec3(0, 0, 0.35));
  const std::uint32_t wheel = world.add_shape(Cylinder{0.25, 0.1});
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.4, 0.4}) {
      BodyState& state = world.add_body(wheel, Vec3(x, y, 0.25));
      state.orientation = turn_between(Vec3::UnitZ(), Vec3::UnitY());
      const auto body = static_cast<std::uint32_t>(world.states.size() - 1);
      add(world, joint_at(JointKind::kHinge, world, 0, body, Vec3(x, y, 0.25), Vec3::UnitY()))
          .motor = JointMotor{4.0, 200.0};
    }
  world.run(180);
  EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), 1.0, 0.02);
  EXPECT_GT(world.states[0].position_m.x(), 2.0);
  EXPECT_GT(world.counters.motor_rows, 0u);
}

double place_of_slider(const World& world) { return world.states[0].position_m.z(); }

// A servo that holds a weight, at no more than its speed; its push never falls short.
World servo_lift(double target, double time_constant_s, double dt_s) {
  World world = lift(0.5, 1e6, dt_s);
  JointMotor& motor = *world.scene.joints[0].motor;
  motor.target = -target;
  motor.time_constant_s = time_constant_s;
  return world;
}

TEST(Servos, GoToTheirTargetAtTheirSpeedAndStayThereUnderAWeight) {
  for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240})
    for (const double time_constant_s : {1e-4, 0.02, 0.1})
      for (const double target : {-0.7, 0.3, 0.9}) {
        World world = servo_lift(target, time_constant_s, dt);
        double fastest = 0.0, passed = 0.0;
        for (int i = 0; i < static_cast<int>(5.0 / dt + 0.5); ++i) {
          const double before = place_of_slider(world);
          world.run(1);
          fastest = std::max(fastest, std::abs(place_of_slider(world) - before) / dt);
          passed = std::max(passed, (place_of_slider(world) - target) * (target > 0 ? 1 : -1));
        }
        EXPECT_NEAR(place_of_slider(world), target, 1e-12) << dt << " " << time_constant_s;
        EXPECT_LT(world.states[0].linear_velocity_m_s.norm(), 1e-11);
        EXPECT_NEAR(fastest, 0.5, 1e-9);
        EXPECT_LT(passed, 1e-12);
      }
}

// What is left falls as an exponential: to second order in the step.
TEST(Servos, ApproachAsTheirTimeConstantSays) {
  for (const double dt : {1.0 / 60, 1.0 / 120, 1.0 / 240}) {
    World world = servo_lift(0.04, 0.1, dt);
    double error = 0.0;
    for (int i = 1; i <= static_cast<int>(0.5 / dt + 0.5); ++i) {
      world.run(1);
      error =
          std::max(error, std::abs(0.04 - place_of_slider(world) - 0.04 * std::exp(-10 * i * dt)));
    }
    EXPECT_LT(error, 0.04 * 50.0 * dt * dt);
  }
}

TEST(Servos, TurnAHingeByAnAngleOfEitherSign) {
  for (const double target : {-2.9, -0.4, 1.5, 2.9}) {
    World world = test::under_gravity();
    world.add_body(world.add_shape(Box{{0.5, 0.1, 0.1}}), Vec3(0.5, 0, 0));
    add(world, joint_at(JointKind::kHinge, world, 0, std::nullopt, Vec3::Zero(), Vec3::UnitY()))
        .motor = JointMotor{3.0, 1e4, target, 0.05};
    world.run(300);
    const Quat& q = world.states[0].orientation;
    // The world is turned against the body.
    EXPECT_NEAR(-2.0 * std::atan2(q.y(), q.w()), target, 1e-10);
  }
}

double angle_between(const World& world, const Joint& joint) {
  const auto frame = [&](BodyId id, const Quat& local) {
    return is_static(id) ? local : Quat(world.states[index_of(id)].orientation * local);
  };
  const Quat rotation = frame(joint.a, joint.frame_a).conjugate() * frame(joint.b, joint.frame_b);
  return 2.0 * std::atan2(rotation.z(), rotation.w());
}

// Ten rods that may bend by 0.3 rad each; they swing against their stops from both sides.
TEST(Limits, AChainOfStopsBendsNoFurtherAndGainsNoEnergy) {
  World world = test::under_gravity();
  const std::uint32_t rod = world.add_shape(Box{{0.25, 0.05, 0.05}});
  for (int i = 0; i < 10; ++i) world.add_body(rod, Vec3(0.25 + 0.5 * i, 0, 0));
  for (std::uint32_t i = 0; i < 10; ++i) {
    const Vec3 anchor(0.5 * i, 0, 0);
    Joint& joint =
        i == 0
            ? add(world, joint_at(JointKind::kHinge, world, 0, std::nullopt, anchor, Vec3::UnitY()))
            : add(world, joint_at(JointKind::kHinge, world, i - 1, i, anchor, Vec3::UnitY()));
    joint.limits = JointLimits{-0.3, 0.3};
    order_joints(world.scene);
  }
  const auto energy = [&world] {
    const Mechanics m = world.mechanics();
    return m.kinetic_energy_joule + m.potential_energy_joule;
  };
  const double start = energy();
  double bent = 0.0, most_energy = start;
  for (int i = 0; i < 600; ++i) {
    world.run(1);
    for (const Joint& joint : world.scene.joints)
      bent = std::max(bent, std::abs(angle_between(world, joint)));
    most_energy = std::max(most_energy, energy());
  }
  EXPECT_LT(bent, 0.3 + 1e-9);
  EXPECT_GT(bent, 0.3 - 1e-6);
  EXPECT_LT(most_energy, start + 1e-3 * world.scene.bodies[0].mass_kg * 10 * kGravity);
}

TEST(Limits, TwoBodiesThatRunIntoAStopGoOnTogether) {
  World world;
  const std::uint32_t box = world.add_shape(Box{{0.2, 0.2, 0.2}});
  world.add_body(box, Vec3(0, 0, 0)).linear_velocity_m_s = Vec3(1, 0, 0);
  world.add_body(box, Vec3(1, 0, 0), 3000.0).linear_velocity_m_s = Vec3(2, 0, 0);
  add(world, joint_at(JointKind::kSlider, world, 0, 1, Vec3(0.5, 0, 0), Vec3::UnitX())).limits =
      JointLimits{-0.2, 0.33};
  world.run(60);
  for (const BodyState& state : world.states)
    EXPECT_NEAR(state.linear_velocity_m_s.x(), (1.0 + 3.0 * 2.0) / 4.0, 1e-12);
  EXPECT_NEAR(world.states[1].position_m.x() - world.states[0].position_m.x(), 1.33, 1e-12);
}

// A gate that opens one way only, and a ball that rolls against its closed side.
TEST(Limits, AGateThatIsShutStopsABall) {
  World world = test::under_gravity();
  world.add_floor();
  world.add_body(world.add_shape(Box{{0.05, 0.5, 0.5}}), Vec3(0, 0.5, 0.6), 200.0);
  add(world, joint_at(JointKind::kHinge, world, 0, std::nullopt, Vec3(0, 0, 0.6), Vec3::UnitZ()))
      .limits = JointLimits{-2.0, 0.0};
  BodyState& ball = world.add_body(world.add_shape(Sphere{0.2}), Vec3(-1, 0.7, 0.2));
  ball.linear_velocity_m_s = Vec3(2, 0, 0);
  double passed = 0.0;
  for (int i = 0; i < 240; ++i) {
    world.run(1);
    passed = std::max(passed, angle_between(world, world.scene.joints[0]));
  }
  EXPECT_LT(passed, 1e-6);
  EXPECT_LT(world.states[1].position_m.x(), 0.0);
}

// The conditions of the bounded problem, for a column of sliders and hinges in any state.
TEST(Bounds, ASolutionPushesWithinThemAndOnlyWhereItHasTo) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    World world;
    const std::uint32_t box = world.add_shape(Box{{0.2, 0.2, 0.2}});
    for (std::uint32_t i = 0; i < 6; ++i) {
      BodyState& state = world.add_body(box, Vec3(0, 0, 0.5 * i), 1000.0 * (1.5 + unit(random)));
      state.linear_velocity_m_s = Vec3(unit(random), unit(random), unit(random));
      state.angular_velocity_rad_s = Vec3(unit(random), unit(random), unit(random));
    }
    for (std::uint32_t i = 0; i + 1 < 6; ++i) {
      const Vec3 axis = Vec3(unit(random), unit(random), 1.5).normalized();
      const JointKind kind = i % 2 == 0 ? JointKind::kHinge : JointKind::kSlider;
      Joint& joint = add(world, joint_at(kind, world, i, i + 1, Vec3(0, 0, 0.5 * i + 0.25), axis));
      joint.limits = trial % 2 == 0 ? JointLimits{0.0, 1.0} : JointLimits{-1.0, 0.0};
      if (i > 1) joint.motor = JointMotor{unit(random), 300.0};
    }
    std::vector<ContactManifold> manifolds;
    for (std::uint32_t i = 0; i + 1 < 6; ++i)
      append_joints(world.scene, BodyId{i}, world.states[i], BodyId{i + 1}, manifolds);
    JointSystem system = find_joints(world.scene, world.ids, manifolds);
    build_joint_rows(world.scene, 0.1, world.states, false, system);
    bound_velocities(0.1, 1e-9, system);
    std::vector<SolverBody> bodies(7);
    for (std::size_t i = 0; i < 6; ++i)
      bodies[i] = solver_body(world.scene.bodies[i], world.states[i]);
    factor_joint_rows(bodies, system);
    solve_bounded(bodies, 0.0, system);
    int bounded = 0;
    for (const JointRow& row : system.rows) {
      const double off = velocity_of(row, bodies) - row.target_m_s;
      if (row.kind == JointRowKind::kHolds) {
        ASSERT_NEAR(off, 0.0, 1e-11) << trial;
      } else if (row.least_newton_s < row.most_newton_s) {
        ++bounded;
        ASSERT_GE(row.impulse_newton_s, row.least_newton_s) << trial;
        ASSERT_LE(row.impulse_newton_s, row.most_newton_s) << trial;
        if (row.impulse_newton_s < row.most_newton_s) {
          ASSERT_GT(off, -1e-11) << trial;
        }
        if (row.impulse_newton_s > row.least_newton_s) {
          ASSERT_LT(off, 1e-11) << trial;
        }
      }
    }
    ASSERT_EQ(bounded, 5 + 3);
  }
}

}  // namespace
}  // namespace soda::physics
