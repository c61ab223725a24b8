// Joints that break where they bear more than they can.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::add;
using test::joint_at;
using test::kGravity;
using test::World;

constexpr double kSteps_s[] = {1.0 / 30.0, 1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0};
constexpr double kNear = 1e-3;  // of the load

const char* name_of(JointKind kind) {
  constexpr const char* kNames[] = {"ball", "hinge", "slider", "fixed", "distance", "spring"};
  return kNames[static_cast<int>(kind)];
}

double weight_of(const World& world, std::size_t body) {
  return world.scene.bodies[body].mass_kg * kGravity;
}

// A box under a joint with the world, at rest.
World hanging(JointKind kind) {
  World world = test::under_gravity();
  world.add_body(world.add_shape(Box{{0.1, 0.15, 0.2}}), Vec3(0.3, 0, -0.7));
  Joint joint = joint_at(kind, world, 0, std::nullopt, Vec3(0.3, 0, -0.5), Vec3::UnitY());
  if (kind == JointKind::kDistance || kind == JointKind::kSpring) {
    joint.anchor_a_m = Vec3::Zero();
    joint.anchor_b_m = Vec3(0.3, 0, 0);
    joint.length_m = 0.7;
  }
  if (kind == JointKind::kSpring) {
    joint.stiffness_newton_m = 50.0 * weight_of(world, 0);
    joint.length_m -= 1.0 / 50.0;
  }
  add(world, joint);
  return world;
}

bool is_whole(const World& world) {
  return world.counters.joints_broken == 0 &&
         std::ranges::all_of(world.states,
                             [](const BodyState& state) { return state.broken_joints.empty(); });
}

// The same bodies without joints, from where they are.
World freed(const World& world) {
  World free = test::under_gravity();
  free.scene = world.scene;
  free.scene.joints.clear();
  order_joints(free.scene);
  free.ids = world.ids;
  free.states = world.states;
  for (BodyState& state : free.states) state.broken_joints.clear();
  return free;
}

void expect_same_motion(const World& world, const World& free, const std::string& what) {
  for (std::size_t i = 0; i < world.states.size(); ++i) {
    BodyState state = world.states[i];
    state.broken_joints.clear();
    EXPECT_TRUE(identical(state, free.states[i]))
        << what << ": " << first_difference(state, free.states[i]).field;
  }
}

TEST(BreakingJoints, AWeightHangsOrFallsFreely) {
  for (int k = 0; k <= static_cast<int>(JointKind::kSpring); ++k)
    for (const double dt_s : kSteps_s)
      for (const double tolerance : {0.0, 1e-6}) {
        const auto kind = static_cast<JointKind>(k);
        const std::string what =
            std::string(name_of(kind)) + ", step " + std::to_string(dt_s) + " s";
        World world = hanging(kind);
        world.scene.dt_s = dt_s;
        world.scene.tolerance = tolerance;
        World strong = world;
        strong.scene.joints[0].most_force_newton = (1.0 + kNear) * weight_of(world, 0);
        order_joints(strong.scene);
        strong.run(200);
        EXPECT_TRUE(is_whole(strong)) << what;
        EXPECT_LE((strong.states[0].position_m - world.states[0].position_m).norm(), 1e-9) << what;

        world.scene.joints[0].most_force_newton = (1.0 - kNear) * weight_of(world, 0);
        order_joints(world.scene);
        world.run(1);
        EXPECT_EQ(world.states[0].broken_joints, std::vector<std::uint32_t>{0}) << what;
        EXPECT_EQ(world.counters.joints_broken, 1u) << what;
        World free = freed(world);
        world.run(40);
        free.run(40);
        expect_same_motion(world, free, what);
        EXPECT_EQ(world.counters.joints_broken, 1u) << what;
        EXPECT_TRUE(world.report.faults.empty()) << what;
      }
}

// A weight under light rods: the masses are up to 1000 to 1.
TEST(BreakingJoints, TheTopJointBearsAllThatHangs) {
  for (const double ratio : {1.0, 10.0, 100.0, 1000.0})
    for (const double factor : {1.0 - kNear, 1.0 + kNear}) {
      World world = test::under_gravity();
      const std::uint32_t rod = world.add_shape(Capsule{0.05, 0.4});
      const std::uint32_t ball = world.add_shape(Sphere{0.2});
      double weight = 0.0;
      for (int i = 0; i < 4; ++i) {
        world.add_body(i < 3 ? rod : ball, Vec3(0, 0, -0.25 - 0.5 * i));
        if (i == 3) {
          BodyParams& last = world.scene.bodies.back();
          const double more = ratio * world.scene.bodies[0].mass_kg / last.mass_kg;
          last.mass_kg *= more;
          last.inertia_local_kg_m2 *= more;
          last.inverse_inertia_local /= more;
        }
        weight += weight_of(world, static_cast<std::size_t>(i));
      }
      for (std::uint32_t i = 0; i < 4; ++i) {
        Joint joint = i == 0 ? joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero())
                             : joint_at(JointKind::kBall, world, i - 1, i, Vec3(0, 0, -0.5 * i));
        if (i == 0) joint.most_force_newton = factor * weight;
        add(world, joint);
      }
      world.run(100);
      EXPECT_EQ(world.counters.joints_broken, factor < 1.0 ? 1u : 0u) << ratio;
      if (factor < 1.0) {
        EXPECT_NEAR(world.states[3].position_m.z(),
                    -1.75 - kGravity * 0.5 * std::pow(99.0 / 60.0, 2), 1e-9);
      }
    }
}

// Of a hung chain whose end is pulled down, a little harder in every step, the top joint breaks.
TEST(BreakingJoints, AChainThatIsPulledBreaksAtItsTop) {
  for (const std::uint32_t links : {2u, 3u, 5u, 10u, 20u, 50u}) {
    World world = test::under_gravity();
    const std::uint32_t link = world.add_shape(Sphere{0.1});
    for (std::uint32_t i = 0; i < links; ++i) world.add_body(link, Vec3(0, 0, -0.2 * i));
    const double weight = weight_of(world, 0), most = (links + 5.25) * weight;
    for (std::uint32_t i = 0; i < links; ++i) {
      const Vec3 anchor(0, 0, 0.1 - 0.2 * i);
      Joint joint = i == 0 ? joint_at(JointKind::kBall, world, 0, std::nullopt, anchor)
                           : joint_at(JointKind::kBall, world, i - 1, i, anchor);
      joint.most_force_newton = most;
      add(world, joint);
    }
    double pull = 0.0;
    while (is_whole(world) && pull < 20.0) {
      pull += 0.5;
      BodyParams& last = world.scene.bodies.back();
      last.own_field_m_s2 = Vec3(0, 0, -pull * weight / last.mass_kg);
      world.run(1);
    }
    EXPECT_EQ(pull, 5.5) << links << " links";  // the first beyond what the top can bear
    EXPECT_EQ(world.states[0].broken_joints, std::vector<std::uint32_t>{0}) << links << " links";
    world.run(20);
    EXPECT_EQ(world.counters.joints_broken, 1u) << links << " links";
  }
}

// Of a ball on a rod that was let go level: where m g cos + m v^2 / l becomes too much.
TEST(BreakingJoints, APendulumBreaksAtItsAngle) {
  constexpr double kLength_m = 1.0, kRadius_m = 0.1;
  const double inertia = kLength_m * kLength_m + 0.4 * kRadius_m * kRadius_m;  // per mass
  const auto force = [&](double angle) {  // over the weight; the angle to the vertical
    const double radial = std::cos(angle) + 2.0 * kLength_m * kLength_m * std::cos(angle) / inertia;
    return std::hypot(radial, std::sin(angle) * (1.0 - kLength_m * kLength_m / inertia));
  };
  for (const double wanted : {1.2, 0.8, 0.4})
    for (const double dt_s : {1.0 / 30.0, 1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0, 1.0 / 960.0}) {
      World world = test::under_gravity();
      world.scene.dt_s = dt_s;
      world.add_body(world.add_shape(Sphere{kRadius_m}), Vec3(kLength_m, 0, 0));
      Joint joint = joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero());
      joint.most_force_newton = force(wanted) * weight_of(world, 0);
      add(world, joint);
      const Geometry geometry(world.scene);
      for (int i = 0; i < 1000 && is_whole(world); ++i) world.run(1, geometry);
      ASSERT_FALSE(is_whole(world));
      const Vec3& at = world.states[0].position_m;
      const double angle = std::atan2(at.x(), -at.z());
      const double speed = world.states[0].angular_velocity_rad_s.norm();
      // The mean over a step exceeds it half a step late, and that is seen at the step's end.
      EXPECT_LE(angle, wanted) << dt_s;
      EXPECT_GE(angle, wanted - 1.6 * speed * dt_s) << dt_s;
    }
}

TEST(BreakingJoints, APendulumThatIsStrongEnoughSwingsOn) {
  World world = test::under_gravity();
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(1, 0, 0));
  Joint joint = joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero());
  joint.most_force_newton = 3.001 * weight_of(world, 0);
  add(world, joint);
  world.run(600);
  EXPECT_TRUE(is_whole(world));
}

// A box that is held out level: its weight bends the joint.
TEST(BreakingJoints, BreakByTorque) {
  struct Held {
    const char* name;
    JointKind kind;
    Vec3 axis;
    bool motor;
  };
  const Held all[] = {{"hinge about the vertical", JointKind::kHinge, Vec3::UnitZ(), false},
                      {"hinge along the arm", JointKind::kHinge, Vec3::UnitX(), false},
                      {"motor", JointKind::kHinge, Vec3::UnitY(), true},
                      {"slider", JointKind::kSlider, Vec3::UnitY(), false},
                      {"fixed", JointKind::kFixed, Vec3::UnitZ(), false}};
  for (const Held& held : all)
    for (const double dt_s : kSteps_s)
      for (const double factor : {1.0 - kNear, 1.0 + kNear}) {
        World world = test::under_gravity();
        world.scene.dt_s = dt_s;
        world.add_body(world.add_shape(Box{{0.2, 0.1, 0.1}}), Vec3(0.8, 0, 0));
        Joint joint = joint_at(held.kind, world, 0, std::nullopt, Vec3::Zero(), held.axis);
        joint.most_torque_newton_m = factor * 0.8 * weight_of(world, 0);
        if (held.motor) joint.motor = JointMotor{0.0, 100.0 * weight_of(world, 0)};
        add(world, joint);
        world.run(1);
        EXPECT_EQ(is_whole(world), factor > 1.0) << held.name << ", step " << dt_s;
        world.run(60);
        EXPECT_EQ(is_whole(world), factor > 1.0) << held.name << ", step " << dt_s;
      }
}

// What rests on what hangs is borne, too: contacts and joints in one island.
TEST(BreakingJoints, LoadsOfContactsCount) {
  for (const bool direct : {true, false})
    for (const double factor : {1.0 - kNear, 1.0 + kNear}) {
      World world = test::under_gravity();
      world.scene.solver.direct = direct;
      const std::uint32_t tray = world.add_shape(Box{{0.5, 0.5, 0.05}});
      const std::uint32_t load = world.add_shape(Box{{0.2, 0.2, 0.2}});
      world.add_body(tray, Vec3(0, 0, 0));
      world.add_body(load, Vec3(0, 0, 0.25));
      const double weight = weight_of(world, 0) + weight_of(world, 1);
      Joint joint = joint_at(JointKind::kFixed, world, 0, std::nullopt, Vec3::Zero());
      joint.most_force_newton = factor * weight;
      add(world, joint);
      world.run(60);
      EXPECT_EQ(is_whole(world), factor > 1.0) << (direct ? "direct" : "sweeps");
    }
}

// A joint that keeps its bodies apart does so until it breaks.
TEST(BreakingJoints, BodiesThatCameOffTouch) {
  for (const bool breaks : {true, false}) {
    World world = test::under_gravity();
    world.add_floor();
    const std::uint32_t box = world.add_shape(Box{{0.2, 0.2, 0.2}});
    world.add_body(box, Vec3(0, 0, 0.2));
    world.add_body(box, Vec3(0.05, 0, 0.8));
    Joint joint = joint_at(JointKind::kFixed, world, 0, 1, Vec3(0, 0, 0.5));
    if (breaks) joint.most_force_newton = 0.5 * weight_of(world, 1);
    add(world, joint);
    world.run(240);
    EXPECT_NEAR(world.states[1].position_m.z(), breaks ? 0.6 : 0.8, 1e-3);
    EXPECT_EQ(is_whole(world), !breaks);
    EXPECT_TRUE(world.report.faults.empty());
    if (!breaks) continue;
    EXPECT_EQ(world.states[0].broken_joints, world.states[1].broken_joints);
    EXPECT_EQ(world.counters.joints_broken, 1u);
  }
}

// Two springs that pull a body that rests between them, without gravity.
TEST(BreakingJoints, StretchedSpringsBreakWhereNothingMoves) {
  World world;
  world.add_body(world.add_shape(Sphere{0.1}), Vec3::Zero());
  for (const double side : {-1.0, 1.0}) {
    Joint joint = joint_at(JointKind::kSpring, world, 0, std::nullopt, Vec3::Zero());
    joint.anchor_b_m = Vec3(side, 0, 0);
    joint.length_m = 0.5;
    joint.stiffness_newton_m = 100.0;
    joint.most_force_newton = side > 0.0 ? 49.9 : 50.1;
    add(world, joint);
  }
  EXPECT_DOUBLE_EQ(world.mechanics().potential_energy_joule, 25.0);
  world.run(1);
  EXPECT_EQ(world.states[0].broken_joints, std::vector<std::uint32_t>{1});
  EXPECT_DOUBLE_EQ(world.mechanics().potential_energy_joule, 12.5);
  world.run(10);
  EXPECT_LT(world.states[0].position_m.x(), -0.01);
}

}  // namespace
}  // namespace soda::physics
