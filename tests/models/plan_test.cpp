#include "models/run/plan.hpp"

#include <gtest/gtest.h>

#include "models/cost/joint_cost.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "physics/step/stages.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::Vec3;

bool needs(const std::vector<PlanLine>& plan, const std::string& stage) {
  for (const PlanLine& line : plan)
    if (line.stage == stage) return line.needed;
  ADD_FAILURE() << "no line for " << stage;
  return false;
}

SimulationResult run_scene(const test::Scene& scene, std::uint32_t worlds,
                           const RunOptions& options) {
  const TerritoryMap map =
      make_territory_map({Grid{Vec3(-4, -4, -4), 1.0, {8, 8, 8}}, worlds, MapKind::kBlocks, 1}, {});
  return simulate(scene.description, scene.states, map, options);
}

void expect_unneeded_stages_cost_nothing(const std::vector<PlanLine>& plan,
                                         const SimulationResult& result) {
  const std::vector<std::uint64_t> counts = plan_counters(plan, result);
  ASSERT_EQ(counts.size(), plan.size());
  for (std::size_t i = 0; i < plan.size(); ++i) {
    if (plan[i].needed) continue;
    EXPECT_EQ(counts[i], 0u) << plan[i].stage << ": " << plan[i].reason;
  }
}

TEST(Plan, SmoothSpheresInOneWorldNeedNeitherFrictionNorBorders) {
  test::Scene scene(Vec3(0, 0, -9.81));
  const physics::Material smooth{0.0, 0.5};
  scene.ground(smooth);
  const std::uint32_t ball = scene.shape(physics::Sphere{0.5});
  for (int i = 0; i < 4; ++i)
    scene.body(ball, Vec3(0.1 * i, 0, 0.6 + 0.95 * i), Vec3::Zero(), smooth);
  const RunOptions options{.steps = 60};
  const std::vector<PlanLine> plan = make_plan(scene.description, 1, options);
  EXPECT_FALSE(needs(plan, "friction rows"));
  EXPECT_TRUE(needs(plan, "restitution rows"));
  EXPECT_TRUE(needs(plan, "analytic kernel"));
  EXPECT_FALSE(needs(plan, "box-box kernel"));
  EXPECT_FALSE(needs(plan, "ghost messages"));
  EXPECT_FALSE(needs(plan, "buffer entries for rollback"));
  const SimulationResult result = run_scene(scene, 1, options);
  EXPECT_GT(result.stages.normal_rows, 0u);
  expect_unneeded_stages_cost_nothing(plan, result);
}

TEST(Plan, OneWorldOnTheVirtualClusterKeepsEntriesAndSaysSo) {
  test::Scene scene;
  scene.body(scene.shape(physics::Box{}), Vec3(0, 0, 0));
  const RunOptions options{.executor = ExecutorKind::kVirtual, .steps = 5};
  expect_unneeded_stages_cost_nothing(make_plan(scene.description, 1, options),
                                      run_scene(scene, 1, options));
}

TEST(Plan, DetectionOnlySceneHasNoSolverButFindsContacts) {
  test::Scene scene;
  scene.description.solver.contact_response = false;
  const std::uint32_t box = scene.shape(physics::Box{});
  scene.body(box, Vec3(0, 0, 0));
  scene.body(box, Vec3(0.5, 0, 0));
  const RunOptions options{.steps = 5};
  const std::vector<PlanLine> plan = make_plan(scene.description, 4, options);
  EXPECT_FALSE(needs(plan, "contact solver"));
  EXPECT_TRUE(needs(plan, "box-box kernel"));
  EXPECT_TRUE(needs(plan, "ghost messages"));
  const SimulationResult result = run_scene(scene, 4, options);
  EXPECT_GT(result.stages.contact_points, 0u);
  expect_unneeded_stages_cost_nothing(plan, result);
}

// Two boxes and two hulls that overlap: who says along which direction they meet is what the scene
// asks for, and the counters tell.
TEST(Plan, FclIsCalledForThePairsThatItIsAskedAbout) {
  struct Asked {
    physics::Narrowphase narrowphase;
    bool boxes, hulls;
  };
  for (const Asked& asked : {Asked{physics::Narrowphase::kAuto, true, false},
                             Asked{physics::Narrowphase::kFcl, true, true},
                             Asked{physics::Narrowphase::kOwn, false, false}})
    for (const bool hulls : {false, true}) {
      test::Scene scene;
      scene.description.narrowphase = asked.narrowphase;
      const std::vector<Vec3> corners = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, -1}};
      const physics::Shape hull = std::get<physics::ConvexHull>(physics::make_convex_hull(corners));
      const std::uint32_t shape = scene.shape(hulls ? hull : physics::Box{});
      scene.body(shape, Vec3(0, 0, 0));
      scene.body(shape, Vec3(0.3, 0.2, 0.1));
      const bool by_fcl = hulls ? asked.hulls : asked.boxes;
      const std::vector<physics::ShapePair> pairs = physics::shape_pairs(scene.description);
      ASSERT_EQ(pairs.size(), 1u);
      EXPECT_EQ(pairs[0].first, hulls ? "hull" : "box");
      EXPECT_EQ(pairs[0].by_fcl, by_fcl);
      const RunOptions options{.steps = 5};
      const std::vector<PlanLine> plan = make_plan(scene.description, 2, options);
      EXPECT_EQ(needs(plan, "FCL's routines"), by_fcl);
      const SimulationResult result = run_scene(scene, 2, options);
      EXPECT_EQ(result.stages.fcl_calls > 0, by_fcl);
      EXPECT_GT(result.stages.contact_points, 0u);
      expect_unneeded_stages_cost_nothing(plan, result);
    }
}

// A box on a belt, and a driven ball: the belt and the ball's drive, each with and without effect.
test::Scene belt_scene(double friction, const Vec3& surface_velocity, bool driven) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground({friction, 0.0});
  scene.description.statics.back().surface_velocity_m_s = surface_velocity;
  scene.body(scene.shape(physics::Box{}), Vec3(0, 0, 0.5));
  scene.body(scene.shape(physics::Sphere{0.5}), Vec3(2, 0, 0.5));
  scene.description.drives.push_back({.velocity_m_s = Vec3(0, 1, 0), .lane = std::nullopt});
  if (driven) scene.description.bodies.back().drive = 0;
  return scene;
}

TEST(Plan, ConveyorRowsAndDrivesAreThereOnlyIfTheyHaveAnEffect) {
  for (const double friction : {0.0, 0.5}) {
    for (const double speed : {0.0, 2.0}) {
      for (const bool driven : {false, true}) {
        const test::Scene scene = belt_scene(friction, Vec3(speed, 0, 0), driven);
        const RunOptions options{.steps = 10};
        const std::vector<PlanLine> plan = make_plan(scene.description, 1, options);
        EXPECT_EQ(needs(plan, "conveyor rows"), friction > 0.0 && speed > 0.0);
        EXPECT_EQ(needs(plan, "driven bodies"), driven);
        const SimulationResult result = run_scene(scene, 1, options);
        EXPECT_EQ(result.stages.conveyor_rows > 0, friction > 0.0 && speed > 0.0);
        EXPECT_EQ(result.stages.driven_bodies, driven ? 10u : 0u);
        expect_unneeded_stages_cost_nothing(plan, result);
      }
    }
  }
}

// A ball that turns on a hinge with the world, in every combination of what it may have.
TEST(Plan, ForcesLimitsAndMotorsAreThereOnlyIfSomethingHasThem) {
  for (int has = 0; has < 8; ++has) {
    test::Scene scene(Vec3(0, 0, -9.81));
    scene.body(scene.shape(physics::Sphere{0.5}), Vec3(0, 0, 5)).angular_velocity_rad_s =
        Vec3(0, 0, 0.5);
    physics::Joint joint;
    joint.kind = physics::JointKind::kHinge;
    joint.anchor_b_m = Vec3(0, 0, 5);
    joint.reach_m = 0.1;
    if (has & 1) joint.limits = physics::JointLimits{-1.0, 1.0};
    if (has & 2) joint.motor = physics::JointMotor{1.0, 10.0};
    scene.description.joints = {joint};
    physics::order_joints(scene.description);
    if (has & 4) scene.description.bodies[0].own_field_m_s2 = Vec3(1, 0, 0);
    const RunOptions options{.steps = 10};
    const std::vector<PlanLine> plan = make_plan(scene.description, 1, options);
    EXPECT_EQ(needs(plan, "limit rows"), (has & 1) != 0);
    EXPECT_EQ(needs(plan, "motor rows"), (has & 2) != 0);
    EXPECT_EQ(needs(plan, "forces and damping"), (has & 4) != 0);
    const SimulationResult result = run_scene(scene, 1, options);
    EXPECT_EQ(result.stages.limit_rows, (has & 1) != 0 ? 20u : 0u);
    EXPECT_EQ(result.stages.motor_rows, (has & 2) != 0 ? 10u : 0u);
    EXPECT_EQ(result.stages.forced_bodies > 0, (has & 4) != 0);
    expect_unneeded_stages_cost_nothing(plan, result);
  }
}

TEST(Plan, APushedBallThatBouncesIsLookedAtForHitsAndNeverFlies) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground({0.5, 0.7});
  scene.body(scene.shape(physics::Sphere{0.5}), Vec3(0, 0, 0.8), Vec3::Zero(), {0.5, 0.0});
  scene.description.forces = {{.body_force_newton = Vec3(1, 0, 0)}};
  scene.description.bodies[0].forces = 0;
  const RunOptions options{.steps = 60};
  const std::vector<PlanLine> plan = make_plan(scene.description, 1, options);
  EXPECT_TRUE(needs(plan, "hits among contacts"));
  EXPECT_FALSE(needs(plan, "impacts in flight"));
  EXPECT_TRUE(needs(plan, "refined steps of islands"));
  const SimulationResult result = run_scene(scene, 1, options);
  EXPECT_GT(result.stages.hit_searches, 0u);
  expect_unneeded_stages_cost_nothing(plan, result);
}

TEST(Plan, WhatHangsOnASpringCanRestWithoutStatics) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.body(scene.shape(physics::Box{}), Vec3(0, 0, 0));
  scene.body(scene.shape(physics::Box{}), Vec3(0, 0, 2));
  EXPECT_FALSE(needs(make_plan(scene.description, 1, {}), "contacts of bodies at rest"));
  physics::Joint spring;
  spring.kind = physics::JointKind::kSpring;
  spring.stiffness_newton_m = 1.0;
  scene.description.joints = {spring};
  physics::order_joints(scene.description);
  EXPECT_TRUE(needs(make_plan(scene.description, 1, {}), "contacts of bodies at rest"));
}

TEST(Plan, AFewBodiesHaveNoLargeIslandUnlessOnAMesh) {
  test::Scene scene(Vec3(0, 0, -9.81));
  scene.ground();
  for (int i = 0; i < 5; ++i) scene.body(scene.shape(physics::Box{}), Vec3(2 * i, 0, 0.5));
  EXPECT_FALSE(needs(make_plan(scene.description, 1, {}), "blocks of giant islands"));
  physics::StaticBody slope;
  slope.shape =
      scene.shape(physics::TriangleMesh{{{-4, -4, 0}, {4, -4, 0}, {4, 4, 0}}, {{0, 1, 2}}});
  scene.description.statics.push_back(slope);
  EXPECT_TRUE(needs(make_plan(scene.description, 1, {}), "blocks of giant islands"));
}

// The input comes when GVT stands at its step, which the world may have executed by then.
TEST(Plan, OneWorldOnTheVirtualClusterRollsBackForWhatAUserDoes) {
  test::Scene scene;
  scene.body(scene.shape(physics::Box{}), Vec3(0, 0, 0));
  RunOptions options{.executor = ExecutorKind::kVirtual, .steps = 40};
  EXPECT_FALSE(needs(make_plan(scene.description, 1, options), "rollback"));
  UserInput push;
  push.step = 20;
  push.kind = InputKind::kPush;
  push.impulse_newton_s = Vec3(1, 0, 0);
  options.inputs.script = {push};
  options.inputs.at_the_last_moment = true;
  options.cluster.latency_ns = 60'000;
  const std::vector<PlanLine> plan = make_plan(scene.description, 1, options);
  EXPECT_TRUE(needs(plan, "rollback"));
  const SimulationResult result = run_scene(scene, 1, options);
  EXPECT_GT(result.events.rollbacks, 0u);
  expect_unneeded_stages_cost_nothing(plan, result);
}

// Balls in a row; on a hub; or on a hub and on the world, too.
enum class Joined { kInRow, kOnHub, kOnHubAndWorld };
test::Scene joined_balls(int balls, Joined how) {
  test::Scene scene;
  const std::uint32_t ball = scene.shape(physics::Sphere{0.1});
  for (int i = 0; i <= balls; ++i) scene.body(ball, Vec3(i, 0, 0));
  for (int i = 1; i <= balls; ++i) {
    physics::Joint joint;
    joint.a = physics::BodyId{static_cast<std::uint32_t>(how == Joined::kInRow ? i - 1 : 0)};
    joint.b = physics::BodyId{static_cast<std::uint32_t>(i)};
    scene.description.joints.push_back(joint);
    if (how != Joined::kOnHubAndWorld) continue;
    joint.a = joint.b;
    joint.b = physics::Joint{}.b;
    scene.description.joints.push_back(joint);
  }
  physics::order_joints(scene.description);
  return scene;
}

TEST(JointCost, IsThatOfTheOrderInWhichThePhysicsEliminates) {
  const auto multiplications = [](int balls, Joined how) {
    const std::vector<JointCost> costs = joint_costs(joined_balls(balls, how).description);
    EXPECT_EQ(costs.size(), 1u);
    const unsigned of_ball = how == Joined::kOnHubAndWorld ? 6 : 3;
    EXPECT_EQ(costs.front().island.rows, of_ball * static_cast<unsigned>(balls));
    return static_cast<double>(costs.front().island.multiplications);
  };
  EXPECT_EQ(multiplications(1, Joined::kOnHub), 5.0);  // a fifth of 3 x 3 x 3
  const auto grows = [&](Joined how) {
    return multiplications(80, how) / multiplications(40, how);
  };
  EXPECT_NEAR(grows(Joined::kInRow), 2.0, 0.1);
  EXPECT_NEAR(grows(Joined::kOnHub), 2.0, 0.1);
  EXPECT_NEAR(grows(Joined::kOnHubAndWorld), 8.0, 0.3);
}

TEST(JointCost, ALargeWheelIsCostlyAndATreeIsNot) {
  EXPECT_TRUE(costly_islands(joined_balls(200, Joined::kInRow).description).empty());
  EXPECT_TRUE(costly_islands(joined_balls(200, Joined::kOnHub).description).empty());
  EXPECT_TRUE(costly_islands(joined_balls(6, Joined::kOnHubAndWorld).description).empty());
  test::Scene wheel = joined_balls(200, Joined::kOnHubAndWorld);
  EXPECT_TRUE(costly_islands(wheel.description).empty());  // swept
  wheel.description.tolerance = 1e-6;
  const std::vector<JointCost> costly = costly_islands(wheel.description);
  ASSERT_EQ(costly.size(), 1u);
  EXPECT_GT(costly.front().of_the_rest, 10.0);
  EXPECT_NE(words_for(wheel.description, costly.front()).find("201 bodies"), std::string::npos);
}

// Nobody rolls back in lockstep, but whoever executes everything twice repeats every step.
TEST(Plan, ExecutingEverythingTwiceTakesIslandsOverInLockstepToo) {
  test::Scene scene(Vec3(0, 0, -9.81));
  const std::uint32_t ball = scene.shape(physics::Sphere{0.5});
  for (const double y : {-2.0, 2.0})
    for (const double x : {-0.4, 0.4}) scene.body(ball, Vec3(x, y, 0), Vec3(-x, 0, 0));
  RunOptions options{.executor = ExecutorKind::kVirtual, .steps = 20};
  options.synchronisation = kernel::Synchronisation::kLockstep;
  for (const bool twice : {false, true}) {
    options.cluster.check_purity = twice;
    const std::vector<PlanLine> plan = make_plan(scene.description, 4, options);
    EXPECT_EQ(needs(plan, "islands taken over by repeated steps"), twice);
    const SimulationResult result = run_scene(scene, 4, options);
    EXPECT_EQ(result.worlds.islands_taken > 0, twice);
    expect_unneeded_stages_cost_nothing(plan, result);
  }
}

TEST(Plan, OptimisticWorldsNeedHistory) {
  test::Scene scene;
  scene.body(scene.shape(physics::Sphere{0.5}), Vec3::Zero(), Vec3(1, 0, 0));
  const RunOptions options{.executor = ExecutorKind::kThreads, .threads = 2, .steps = 30};
  const std::vector<PlanLine> plan = make_plan(scene.description, 8, options);
  EXPECT_TRUE(needs(plan, "buffer entries for rollback"));
  EXPECT_FALSE(needs(plan, "broadphase pairs"));
  const SimulationResult result = run_scene(scene, 8, options);
  EXPECT_GT(result.worlds.entries_saved, 0u);
  expect_unneeded_stages_cost_nothing(plan, result);
  EXPECT_FALSE(needs(make_plan(scene.description, 1, options), "buffer entries for rollback"));
}

}  // namespace
}  // namespace soda::models
