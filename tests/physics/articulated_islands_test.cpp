// Articulated islands to a tolerance, and the two ways in which a single body on a ball joint can
// be moved.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "physics/integrators/ball_motion.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/rattle_motion.hpp"
#include "physics/measures/refinement_error.hpp"
#include "physics/solvers/unconstrained_reference.hpp"
#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::about;
using test::add;
using test::joint_at;
using test::World;

constexpr double kStep_s = 1.0 / 60.0;

// Its point at the origin, leaning over.
World top(const Shape& shape, const Vec3& centre, double lean_rad,
          const Vec3& angular_velocity_local) {
  World world = test::under_gravity();
  const Quat lean = about(Vec3::UnitY(), lean_rad);
  BodyState& body = world.add_body(world.add_shape(shape), lean * centre);
  body.orientation = lean;
  body.angular_velocity_rad_s = lean * angular_velocity_local;
  body.linear_velocity_m_s = body.angular_velocity_rad_s.cross(body.position_m);
  add(world, joint_at(JointKind::kBall, world, 0, std::nullopt, Vec3::Zero()));
  return world;
}

// Rods end to end along x from the world, or isolated; the last is as heavy as stated.
World rods(JointKind kind, int count, bool held, double last_density) {
  World world = test::under_gravity();
  const std::uint32_t rod = world.add_shape(Box{{0.25, 0.06, 0.04}});
  for (int i = 0; i < count; ++i)
    world.add_body(rod, Vec3(0.25 + 0.5 * i, 0, 0), i + 1 < count ? 1000.0 : last_density);
  if (held) add(world, joint_at(kind, world, 0, std::nullopt, Vec3::Zero(), Vec3::UnitY()));
  for (int i = 0; i + 1 < count; ++i) {
    const auto a = static_cast<std::uint32_t>(i);
    add(world, joint_at(kind, world, a, a + 1, Vec3(0.5 * (i + 1), 0, 0), Vec3::UnitY()));
  }
  return world;
}

struct Case {
  std::string name;
  World world;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  const Shape disc = Cylinder{0.3, 0.1};
  const Shape brick = Box{{0.1, 0.2, 0.3}};
  all.push_back({"fast top", top(disc, Vec3(0, 0, 0.3), 0.5, Vec3(1, 0, 40))});
  all.push_back({"slow top", top(disc, Vec3(0, 0, 0.3), 0.5, Vec3(0, 1, 5))});
  all.push_back({"pendulum", top(brick, Vec3(0, 0, -0.5), 1.0, Vec3::Zero())});
  all.push_back({"brick by a corner", top(brick, Vec3(0.1, 0.2, -0.3), 0.7, Vec3(6, -8, 9))});
  all.push_back({"two rods", rods(JointKind::kBall, 2, true, 1000.0)});
  all.push_back({"five rods and a weight", rods(JointKind::kBall, 5, true, 50000.0)});
  all.push_back({"three hinged rods", rods(JointKind::kHinge, 3, true, 1000.0)});
  World isolated = rods(JointKind::kBall, 3, false, 3000.0);
  isolated.states[2].angular_velocity_rad_s = Vec3(3, 5, -4);
  isolated.states[2].linear_velocity_m_s =
      isolated.states[2].angular_velocity_rad_s.cross(Vec3(0.25, 0, 0));
  all.push_back({"isolated rods", std::move(isolated)});
  return all;
}

double gap_m(const World& world) {
  double most = 0.0;
  for (const Joint& joint : world.scene.joints) {
    const BodyState& a = world.states[index_of(joint.a)];
    Vec3 end = joint.anchor_b_m;
    if (!is_static(joint.b)) {
      const BodyState& b = world.states[index_of(joint.b)];
      end = b.position_m + b.orientation * joint.anchor_b_m;
    }
    most = std::max(most, (a.position_m + a.orientation * joint.anchor_a_m - end).norm());
  }
  return most;
}

struct Step {
  std::vector<BodyState> from, to;
};

// Without a tolerance, in many steps for each.
std::vector<Step> exact_steps(World world, int count) {
  constexpr int kParts = 128;
  world.scene.dt_s = kStep_s / kParts;
  std::vector<Step> steps;
  for (int i = 0; i < count; ++i) {
    steps.push_back({world.states, {}});
    world.run(kParts);
    steps.back().to = world.states;
  }
  return steps;
}

// One step from where each exact one begins.
void expect_honest(const Case& one, const std::vector<Step>& exact, double tolerance) {
  constexpr double kRounding = 1e-11, kGap_m = 1e-13;
  World world = one.world;
  world.scene.dt_s = kStep_s;
  world.scene.tolerance = tolerance;
  const Geometry geometry(world.scene);
  const BodySizes sizes = sizes_of(world.scene, geometry, world.ids);
  double used = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    world.states = exact[i].from;
    world.run(1, geometry);
    ASSERT_EQ(world.report.islands.size(), 1u);
    const IslandReport& island = world.report.islands.front();
    const std::string what = one.name + ", step " + std::to_string(i);
    EXPECT_LE(apart_of(sizes, exact[i].to, world.states).relative_error,
              island.error_estimate + kRounding)
        << what << " to " << tolerance;
    EXPECT_LE(island.error_estimate, tolerance) << what;
    EXPECT_FALSE(island.beyond_tolerance) << what;
    EXPECT_LT(gap_m(world), kGap_m) << what;
    used = std::max(used, island.error_estimate);
  }
  EXPECT_GT(used, 1e-4 * tolerance) << one.name << " does much more than " << tolerance;
}

TEST(ArticulatedIslandsToATolerance, ErrByNoMoreInAStepThanTheyEstimateAndMay) {
  constexpr int kSteps = 45;
  for (const Case& one : cases()) {
    const std::vector<Step> exact = exact_steps(one.world, kSteps);
    for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-6, 1e-8})
      expect_honest(one, exact, tolerance);
  }
}

TEST(ArticulatedIslandsToATolerance, TakeWorkThatFallsWithIt) {
  for (const Case& one : cases()) {
    const auto work = [&one](double tolerance) {
      World world = one.world;
      world.scene.tolerance = tolerance;
      world.run(30);
      return world.counters.solver_iterations;
    };
    EXPECT_LT(work(1e-2), work(0.0)) << one.name;
    EXPECT_LT(work(1e-2), work(1e-5)) << one.name;
    EXPECT_LT(work(1e-5), work(1e-9)) << one.name;
    EXPECT_GT(work(1e-9), work(0.0)) << one.name;
  }
}

TEST(BallMotion, IsThatOfAnyArticulatedIsland) {
  for (const Case& one : cases()) {
    const World& world = one.world;
    std::vector<ContactManifold> manifolds;
    append_world_joints(world.scene, world.ids, world.states, manifolds);
    JointSystem joints = find_joints(world.scene, world.ids, manifolds);
    const Joint* const ball = BallMotion::joint_of(world.scene, world.ids, joints);
    EXPECT_EQ(ball != nullptr, world.ids.size() == 1) << one.name;
    if (ball == nullptr) continue;
    BallMotion single(world.scene, world.ids.front(), *ball);
    RattleMotion any(world.scene, world.ids, joints);
    single.start(world.states);
    any.start(world.states);
    EXPECT_NEAR(single.swing_rad_s(kStep_s), any.swing_rad_s(kStep_s), 1e-12) << one.name;
    EXPECT_FALSE(single.goes_against_joints() || any.goes_against_joints()) << one.name;
    IslandReport of_single, of_any;
    for (const double share : {0.4, 0.3, -0.5, 0.4, 0.25, 1.0}) {
      ASSERT_TRUE(single.advance(share * kStep_s, of_single)) << one.name;
      ASSERT_TRUE(any.advance(share * kStep_s, of_any)) << one.name;
      const BodyState &a = single.states().front(), &b = any.states().front();
      EXPECT_LT((a.position_m - b.position_m).norm(), 1e-13) << one.name;
      EXPECT_LT(a.orientation.angularDistance(b.orientation), 1e-12) << one.name;
      EXPECT_LT((a.angular_velocity_rad_s - b.angular_velocity_rad_s).norm(), 1e-11) << one.name;
      const KickChange &x = single.kick_changes().front(), &y = any.kick_changes().front();
      EXPECT_LT((x.linear_m_s - y.linear_m_s).norm(), 1e-11) << one.name;
      EXPECT_LT((x.angular_rad_s - y.angular_rad_s).norm(), 1e-11) << one.name;
    }
    const double mass = world.scene.bodies.front().mass_kg;
    EXPECT_LT((of_single.static_impulse_newton_s - of_any.static_impulse_newton_s).norm(),
              1e-11 * mass)
        << one.name;
    EXPECT_LT(
        (of_single.static_angular_impulse_newton_m_s - of_any.static_angular_impulse_newton_m_s)
            .norm(),
        1e-11 * mass)
        << one.name;
  }
}

// Iterations that diverge give the statics an endless impulse, and 0 times that to their velocity.
TEST(UnconstrainedReference, StartFromStaticsAtRestWhateverIterationsMadeOfThem) {
  World world = top(Sphere{0.3}, Vec3(0, 0, 0.5), 0.3, Vec3(0, 2, 0));
  std::vector<ContactManifold> manifolds;
  append_world_joints(world.scene, world.ids, world.states, manifolds);
  JointSystem joints = find_joints(world.scene, world.ids, manifolds);
  build_joint_rows(world.scene, kStep_s, world.states, false, joints);
  ContactProblem problem;
  problem.bodies = bodies_at(world.scene, world.ids, world.states);
  std::vector<SolverBody> free(problem.bodies.begin(), problem.bodies.begin() + 1);
  free[0].linear = Vec3(1, 2, 3);
  ASSERT_EQ(problem.bodies.size(), 2u);
  problem.bodies[1].linear = problem.bodies[1].angular = Vec3::Constant(std::nan(""));
  factor_joint_rows(problem.bodies, joints);
  solve_unconstrained_reference(free, joints, problem);
  EXPECT_EQ(problem.bodies[1].linear, Vec3(Vec3::Zero()));
  EXPECT_EQ(problem.bodies[1].angular, Vec3(Vec3::Zero()));
  for (const JointRow& row : joints.rows) {
    EXPECT_TRUE(std::isfinite(row.impulse_newton_s));
    EXPECT_NEAR(velocity_of(row, problem.bodies), 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace soda::physics
