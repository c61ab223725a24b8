// The solver's quality: what it sets, and what keys beside it keep.
#include <gtest/gtest.h>

#include "scenarios/read_scenario.hpp"

namespace soda::scenarios {
namespace {

physics::SceneDescription scene_with(const std::string& keys) {
  return read_scenario_text(
             R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 5)" + keys +
                 "}",
             "a.json", {})
      .scene;
}

TEST(SolverQuality, TradesSubstepsAndPartsForTime) {
  const auto fast = scene_with(R"(, "solver": {"quality": "fast"})");
  EXPECT_EQ(fast.solver.iterations, 24);
  EXPECT_FALSE(fast.solver.refined);
  EXPECT_EQ(fast.tolerance, 0.0);
  const auto accurate = scene_with(R"(, "solver": {"quality": "accurate"})");
  EXPECT_EQ(accurate.solver.iterations, 60);
  EXPECT_TRUE(accurate.solver.refined);
  EXPECT_EQ(accurate.tolerance, 1e-6);
}

TEST(SolverQuality, BalancedIsTheDefaultAndChangesNothing) {
  const auto none = scene_with(""), balanced = scene_with(R"(, "solver": {"quality": "balanced"})");
  EXPECT_EQ(none.solver.iterations, balanced.solver.iterations);
  EXPECT_EQ(none.solver.iterations, physics::SolverSettings{}.iterations);
  EXPECT_TRUE(none.solver.refined && balanced.solver.refined);
  EXPECT_EQ(balanced.tolerance, 0.0);
}

TEST(SolverQuality, GivesWayToWhatTheFileSaysBesideIt) {
  const auto scene = scene_with(
      R"(, "solver": {"quality": "accurate", "iterations": 8}, "accuracy": {"tolerance": 1e-3})");
  EXPECT_EQ(scene.solver.iterations, 8);
  EXPECT_EQ(scene.tolerance, 1e-3);
}

}  // namespace
}  // namespace soda::scenarios
