#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "analysis/measures/error_measures.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/nearest_name.hpp"
#include "analysis/text/shell_words.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

TEST(NearestName, FindsMisspeltNamesAndOnlyThose) {
  const std::vector<std::string> names = {"run", "replay", "plan", "schema", "anticipation"};
  EXPECT_EQ(nearest_name("rnu", names), "run");
  EXPECT_EQ(nearest_name("repaly", names), "replay");
  EXPECT_EQ(nearest_name("anticpation", names), "anticipation");
  EXPECT_EQ(nearest_name("quit", names), "");
  EXPECT_EQ(nearest_name("", names), "");
  EXPECT_EQ(nearest_name(std::string(100000, 'x'), names), "");
}

TEST(ShellWords, AreQuotedWhereAShellWouldTakeThemOtherwise) {
  EXPECT_EQ(as_typed({"soda", "run", "a/b-1.json", "--peak", "0,1@2+1", "--map=x"}),
            "soda run a/b-1.json --peak 0,1@2+1 --map=x");
  EXPECT_EQ(as_typed({"soda", "my file", "", "$x", "it's"}), "soda 'my file' '' '$x' 'it'\\''s'");
}

TEST(BrokenPlan, IsALineThatCountsThoughItIsNotNeeded) {
  MeasuredRun run;
  run.plan = {{"friction rows", true, "rough", {}},
              {"motor rows", false, "no joint has a motor", {}},
              {"limit rows", false, "no joint has limits", {}}};
  run.plan_counters = {5, 0, 1};
  EXPECT_EQ(
      broken_plan_lines(run),
      std::vector<std::string>{"limit rows: not needed (no joint has limits), but counted 1"});
}

TEST(TextTable, ColumnsAreAsWideAsTheirWidestCell) {
  EXPECT_EQ(format_table({{"name"}, {"n", Align::kRight}}, {{"a", "100"}, {"longer", "1"}}),
            "  name      n\n"
            "  -----------\n"
            "  a       100\n"
            "  longer    1\n");
}

TEST(TextTable, ExactNumbersReadBackAsTheSameBits) {
  for (const double value : {0.1, -0.0, 1e300, 5e-324, 1.0 / 3.0}) {
    EXPECT_EQ(format_bits(std::strtod(format_exact(value).c_str(), nullptr)), format_bits(value));
  }
  EXPECT_EQ(format_bits(1.0), "0x3ff0000000000000");
  EXPECT_EQ(format_digest(0xabcu), "0000000000000abc");
}

models::TerritoryOptions territory_of(std::int32_t cells) {
  models::TerritoryOptions territory;
  territory.grid.cells = {cells, 1, 1};
  return territory;
}

TEST(Overrides, AThreadCountAloneSelectsTheThreadsExecutor) {
  models::TerritoryOptions territory = territory_of(4);
  models::RunOptions run;
  Overrides overrides;
  overrides.threads = 2;
  apply_overrides(overrides, territory, run);
  EXPECT_EQ(run.executor, models::ExecutorKind::kThreads);
  EXPECT_EQ(run.threads, 2u);
}

TEST(Overrides, ValuesOutOfRangeAreUsageErrors) {
  const auto apply = [](const Overrides& overrides) {
    models::TerritoryOptions territory = territory_of(4);
    models::RunOptions run;
    apply_overrides(overrides, territory, run);
  };
  Overrides worlds, none, buffer, steps, threads;
  worlds.worlds = 5;
  none.worlds = 0;
  buffer.buffer = 0;
  steps.steps = -1;
  threads.threads = 2;
  threads.executor = models::ExecutorKind::kSequential;
  for (const Overrides& overrides : {worlds, none, buffer, steps, threads}) {
    EXPECT_THROW(apply(overrides), UsageError);
  }
  Overrides fitting;
  fitting.worlds = 4;
  fitting.buffer = 1;
  fitting.steps = 0;
  EXPECT_NO_THROW(apply(fitting));
}

TEST(Overrides, AnExecutorAskedForAnewDoesNotInheritTheOldThreads) {
  Overrides logged, sequential;
  logged.threads = 4;
  logged.worlds = 8;
  sequential.executor = models::ExecutorKind::kSequential;
  const Overrides both = combined(logged, sequential);
  EXPECT_FALSE(both.threads.has_value());
  EXPECT_EQ(both.worlds, 8u);
}

TEST(Overrides, ThreadsAskedForLeaveTheClusterAndItsCheckOfPurity) {
  Overrides logged, threads;
  logged.cluster.check_purity = true;
  logged.cluster.latency_us = 5.0;
  threads.threads = 4;
  EXPECT_FALSE(combined(logged, threads).cluster.given());
  EXPECT_TRUE(combined(logged, {}).cluster.check_purity);
}

physics::SceneDescription falling_ball() {
  physics::SceneDescription scene;
  scene.gravity_m_s2 = physics::Vec3(0.0, 0.0, -10.0);
  scene.dt_s = 0.125;
  scene.shapes.push_back(physics::Sphere{0.5});
  scene.bodies.emplace_back();
  scene.bodies[0].mass_kg = 2.0;
  return scene;
}

TEST(ErrorMeasures, ExactFreeFallHasNone) {
  const physics::SceneDescription scene = falling_ball();
  std::vector<physics::BodyState> start(1), end(1);
  end[0].position_m.z() = -5.0;  // after 8 steps, 1 s
  end[0].linear_velocity_m_s.z() = -10.0;
  const ErrorMeasures error = measure_errors(scene, start, end, 8, {});
  EXPECT_EQ(error.energy_drift_rel, 0.0);
  EXPECT_EQ(error.momentum_drift_rel, 0.0);
}

TEST(ErrorMeasures, AKinematicBodyDoesNotFallAndIsInNoBalance) {
  physics::SceneDescription scene = falling_ball();
  scene.bodies.push_back(scene.bodies[0]);
  scene.bodies[1].kinematic = true;
  std::vector<physics::BodyState> start(2), end(2);
  end[0].position_m.z() = -5.0;
  end[0].linear_velocity_m_s.z() = -10.0;
  end[1].position_m.x() = 3.0;
  EXPECT_EQ(measure_errors(scene, start, end, 8, {}).momentum_drift_rel, 0.0);
}

TEST(ErrorMeasures, LostEnergyIsNegativeAndRelativeToTheLargestChange) {
  const physics::SceneDescription scene = falling_ball();
  std::vector<physics::BodyState> start(1), end(1);
  end[0].position_m.z() = -5.0;  // 100 J of 2 kg * 10 m/s^2 * 5 m, all lost
  RunTotals totals;
  const physics::IslandReport floor{.static_impulse_newton_s = physics::Vec3(0.0, 0.0, 20.0)};
  add_islands(std::span(&floor, 1), totals);
  const ErrorMeasures error = measure_errors(scene, start, end, 8, totals);
  EXPECT_EQ(error.energy_drift_rel, -1.0);
  EXPECT_EQ(error.momentum_drift_rel, 0.0);  // the floor took what gravity gave
}

TEST(ErrorMeasures, AnUnexplainedImpulseIsMomentumDrift) {
  const physics::SceneDescription scene = falling_ball();
  std::vector<physics::BodyState> start(1), end(1);
  end[0].linear_velocity_m_s = physics::Vec3(1.0, 0.0, -10.0);
  const ErrorMeasures error = measure_errors(scene, start, end, 8, {});
  EXPECT_DOUBLE_EQ(error.momentum_drift_rel, 2.0 / (2.0 * std::sqrt(101.0)));
}

// A million times the double 0.1, which is 0.1 (1 + 5.6e-17): 1e5 to its last bit but one. A plain
// sum is off by 1.3e-6.
TEST(CarryingSum, DoesNotDriftOverAMillionEqualParts) {
  CarryingSum sum;
  for (int i = 0; i < 1000000; ++i) sum.add(physics::Vec3(0.1, 0.0, -0.1));
  EXPECT_NEAR(sum.value.x(), 1e5, 3e-11);
  EXPECT_EQ(sum.value.y(), 0.0);
  EXPECT_EQ(sum.value.z(), -sum.value.x());
}

// 8 steps in which a drive gives the full 4 m/s^2: 1 s, so 2 kg * 4 m/s of momentum.
TEST(ErrorMeasures, TheImpulseOfDrivesIsExplained) {
  physics::SceneDescription scene = falling_ball();
  scene.drives.push_back({.time_constant_s = 0.5,
                          .max_acceleration_m_s2 = 4.0,
                          .velocity_m_s = physics::Vec3(1000.0, 0.0, 0.0),
                          .lane = std::nullopt});
  scene.bodies[0].drive = 0;
  const std::vector<physics::BodyState> start(1);
  std::vector<physics::BodyState> end(1);
  end[0].linear_velocity_m_s = physics::Vec3(4.0, 0.0, -10.0);
  RunTotals totals;
  for (int step = 0; step < 8; ++step) add_drives(scene, all_ids(1), start, totals);
  EXPECT_EQ(measure_errors(scene, start, end, 8, totals).momentum_drift_rel, 0.0);
  EXPECT_GT(measure_errors(scene, start, end, 8, {}).momentum_drift_rel, 0.1);
}

TEST(ErrorMeasures, NothingMovingWithoutGravityIsNoDivisionByZero) {
  physics::SceneDescription scene = falling_ball();
  scene.gravity_m_s2 = physics::Vec3::Zero();
  const std::vector<physics::BodyState> rest(1);
  const ErrorMeasures error = measure_errors(scene, rest, rest, 8, {});
  EXPECT_EQ(error.energy_drift_rel, 0.0);
  EXPECT_EQ(error.momentum_drift_rel, 0.0);
}

TEST(ErrorMeasures, TotalsKeepTheWorstIslandOfTheRun) {
  RunTotals totals;
  physics::IslandReport a, b;
  a.max_penetration_m = 0.25;
  a.constraint_residual_m_s = 0.5;
  b.max_penetration_m = 0.125;
  b.constraint_residual_m_s = 1.5;
  add_islands(std::span(&a, 1), totals);
  add_islands(std::span(&b, 1), totals);
  EXPECT_EQ(totals.max_penetration_m, 0.25);
  EXPECT_EQ(totals.constraint_residual_m_s, 1.5);
}

}  // namespace
}  // namespace soda::analysis
