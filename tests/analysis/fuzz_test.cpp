// Random scenes: that they are what they say, that failures are noticed, and made small.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <set>
#include <thread>

#include "analysis/process/isolated_process.hpp"
#include "analysis/search/fuzz_search.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

FuzzOutcome failure(const std::string& what) { return {true, false, what, {}}; }

TEST(Fuzz, WhatIsReadIsWhatWasDrawnToTheBit) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const FuzzScene drawn =
        draw_scene(seed, 30, seed % 2 == 0 ? FuzzJoints::kRigid : FuzzJoints::kSprings);
    const scenarios::Scenario read =
        scenarios::read_scenario_text(scenario_text(drawn, "a scene"), "fuzz.json");
    EXPECT_EQ(read.run.steps, 30);
    EXPECT_EQ(read.scene.dt_s, drawn.time_step_s);
    EXPECT_EQ(read.scene.joints.size(), drawn.joints.size());
    EXPECT_EQ(read.scene.statics.size(), drawn.statics.size());
    ASSERT_EQ(read.initial.size(), drawn.bodies.size());
    for (std::size_t i = 0; i < drawn.bodies.size(); ++i) {
      EXPECT_EQ(read.scene.bodies[i].mass_kg, drawn.bodies[i].mass_kg);
      EXPECT_EQ(read.initial[i].linear_velocity_m_s, drawn.bodies[i].velocity_m_s);
      if (drawn.bodies[i].shape.kind == FuzzShapeKind::kHull) continue;  // moves to its centre
      EXPECT_EQ(read.initial[i].position_m, drawn.bodies[i].position_m);
    }
  }
}

TEST(Fuzz, DrawsReachEveryShapeAndTheEndsOfEveryRange) {
  std::set<FuzzShapeKind> moving, fixed;
  std::set<std::string> joints, limited, driven;
  std::set<std::size_t> counts;
  double small = 1.0, large = 1.0, light = 1.0, heavy = 1.0;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    const FuzzScene scene = draw_scene(seed, 1, FuzzJoints::kRigid);
    counts.insert(scene.bodies.size());
    for (const FuzzBody& body : scene.bodies) {
      moving.insert(body.shape.kind);
      small = std::min(small, body.shape.size_m.minCoeff());
      large = std::max(large, body.shape.size_m.maxCoeff());
      light = std::min(light, body.mass_kg);
      heavy = std::max(heavy, body.mass_kg);
    }
    for (const FuzzStatic& thing : scene.statics) fixed.insert(thing.shape.kind);
    for (const FuzzJoint& joint : scene.joints) {
      joints.insert(joint.type);
      if (joint.limits) limited.insert(joint.type);
      if (joint.motor) driven.insert(joint.type);
    }
  }
  EXPECT_EQ(moving.size(), 5u);
  EXPECT_EQ(fixed.size(), 7u);
  EXPECT_EQ(joints.size(), 5u);
  EXPECT_EQ(limited, (std::set<std::string>{"hinge", "slider"}));
  EXPECT_EQ(driven, (std::set<std::string>{"hinge", "slider"}));
  EXPECT_EQ(counts.size(), 12u);
  EXPECT_EQ(small, 1e-3);
  EXPECT_GT(large, 500.0);
  EXPECT_LT(light, 1e-8);
  EXPECT_GT(heavy, 1e8);
}

// A force does work, of which the checks know nothing.
constexpr const char* kPushed = R"({
  "format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 20,
  "materials": [{"name": "stuff", "friction": 0, "restitution": 0}],
  "bodies": [{"id": 7, "shape": {"type": "sphere", "radius_m": 0.1}, "mass_kg": 1,
              "material": "stuff", "position_m": [1, 0, 0], "force_newton": [10, 0, 0]}]})";

TEST(Fuzz, AGainOfEnergyIsNoticedAndLocated) {
  const FuzzOutcome outcome = try_scene(kPushed);
  EXPECT_TRUE(outcome.failed);
  EXPECT_FALSE(outcome.refused);
  EXPECT_NE(outcome.what.find("step 1, body 7: energy: "), std::string::npos) << outcome.what;
}

TEST(Fuzz, ASceneThatIsRefusedIsNoFailureOfPhysics) {
  const FuzzOutcome outcome = try_scene("{\"format\": 1}");
  EXPECT_TRUE(outcome.failed);
  EXPECT_TRUE(outcome.refused) << outcome.what;
}

TEST(Fuzz, AFailureIsShrunkToWhatItNeeds) {
  FuzzScene scene = draw_scene(3, 60);
  while (scene.bodies.size() < 5) scene = draw_scene(scene.seed + 1, 60);
  const std::uint32_t needed = scene.bodies[2].id;
  const ShrunkScene smallest = shrink(scene, "as drawn", {400}, [&](const FuzzScene& s) {
    const bool there = std::any_of(s.bodies.begin(), s.bodies.end(),
                                   [&](const FuzzBody& body) { return body.id == needed; });
    return there && s.steps >= 7 ? failure("still") : FuzzOutcome{};
  });
  ASSERT_EQ(smallest.scene.bodies.size(), 1u);
  const FuzzBody& body = smallest.scene.bodies[0];
  EXPECT_EQ(body.id, needed);
  EXPECT_EQ(smallest.scene.steps, 7);
  EXPECT_TRUE(smallest.scene.statics.empty());
  EXPECT_TRUE(smallest.scene.joints.empty());
  EXPECT_EQ(body.shape.kind, FuzzShapeKind::kSphere);
  EXPECT_EQ(body.mass_kg, 1.0);
  EXPECT_EQ(body.velocity_m_s, physics::Vec3(physics::Vec3::Zero()));
  EXPECT_EQ(smallest.what, "still");
  EXPECT_LE(smallest.tried, 400u);
}

TEST(Fuzz, ShrinkingStopsAtItsLimit) {
  const FuzzScene scene = draw_scene(5, 60);
  const TryScene always = [](const FuzzScene&) { return failure("always"); };
  EXPECT_EQ(shrink(scene, "", {3}, always).tried, 3u);
  int asked = 0;
  EXPECT_EQ(shrink(scene, "", {400, [&] { return ++asked > 5; }}, always).tried, 5u);
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

TEST(IsolatedProcess, IsLimitedByWhatItComputesNotByHowLongItWaitsForAProcessor) {
  const auto wait = [](ChildResults&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
  };
  EXPECT_FALSE(run_in_child(wait, {.cpu_s = 1}).failed);
  const ChildOutcome endless = run_in_child(
      [](ChildResults&) {
        while (cpu_s() < 20.0) {
        }
      },
      {.cpu_s = 1});
  EXPECT_TRUE(endless.failed);
  EXPECT_NE(endless.what.find("CPU time limit exceeded"), std::string::npos) << endless.what;
}

TEST(IsolatedProcess, EndsThoughItWaitsForWhatDoesNotCome) {
  const auto wait = [](ChildResults&) { std::this_thread::sleep_for(std::chrono::seconds(20)); };
  const ChildOutcome waiting = run_in_child(wait, {.wall_s = 1});
  EXPECT_TRUE(waiting.failed);
  EXPECT_NE(waiting.what.find("Alarm clock"), std::string::npos) << waiting.what;
}

}  // namespace
}  // namespace soda::analysis
