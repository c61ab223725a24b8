#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/anticipation/anticipation_report.hpp"
#include "analysis/commands/anticipation_command.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/svg_plot.hpp"
#include "models/load_balancing/load_balancer.hpp"

namespace soda::analysis {
namespace {

using models::anticipation_steps;

constexpr auto kQuiet = [](std::size_t, std::size_t) {};

scenarios::Scenario idle_on_cluster(std::uint32_t worlds, unsigned processors) {
  scenarios::Scenario scenario = idle_scene(worlds);
  scenario.run.executor = models::ExecutorKind::kVirtual;
  scenario.run.constant_cost = true;
  scenario.run.cluster.bag_cost_ns = 0;
  scenario.run.cluster.processors = processors;
  return scenario;
}

AnticipationOptions modelled(std::vector<std::int64_t> buffers, std::vector<double> overloads) {
  AnticipationOptions options;
  options.buffers = std::move(buffers);
  options.overloads = std::move(overloads);
  options.measured = false;
  options.max_steps = 1'000'000;
  return options;
}

TEST(Anticipation, ClosedFormGivesThePapersFactsTable) {
  EXPECT_DOUBLE_EQ(anticipation_steps(48, 1.1), 48 * 1.1 / (1.1 - 1.0));
  EXPECT_EQ(law_steps(48, 1.1), 528);
  EXPECT_EQ(law_steps(48, 1.25), 240);
  EXPECT_EQ(law_steps(48, 1.5), 144);
  EXPECT_EQ(law_steps(48, 2.0), 96);
  EXPECT_EQ(law_steps(48, 4.0), 64);
  EXPECT_TRUE(std::isinf(anticipation_steps(48, 1.0)));
  EXPECT_LT(law_steps(48, 1.0), 0);
  EXPECT_LT(law_steps(48, 0.5), 0);
}

// One world of the kernel with its transform buffer, by the clock of the virtual cluster.
TEST(Anticipation, AModelledWorldLastsExactlyAsLongAsTheLawSays) {
  const scenarios::Scenario scenario = idle_on_cluster(1, 1);
  const AnticipationOptions options = modelled(
      {1, 2, 3, 7, 12, 48, 129, 512, 1024}, {0.1, 0.125, 0.2, 0.25, 0.3, 0.37, 0.4, 0.5, 0.6, 0.75,
                                             0.8, 0.9,   1.0, 1.2,  1.5, 2.0,  2.5, 3.0, 4.0, 9.0});
  const std::vector<AnticipationPoint> points = anticipation(scenario, options, kQuiet);
  ASSERT_EQ(points.size(), options.buffers.size() * options.overloads.size());
  for (const AnticipationPoint& point : points) {
    const AnticipationRun& run = *point.modelled;
    ASSERT_TRUE(run.late) << point.buffer << " " << point.overload;
    EXPECT_EQ(run.filled, point.buffer);
    EXPECT_EQ(run.steps, law_steps(point.buffer, 1.0 + point.overload))
        << point.buffer << " " << point.overload;
    if (!std::isnan(run.ratio)) EXPECT_NEAR(run.ratio, 1.0 + point.overload, 1e-6);
    if (point.buffer >= 48) EXPECT_FALSE(std::isnan(run.ratio));
  }
}

TEST(Anticipation, AModelledWorldThatKeepsUpIsNeverLate) {
  AnticipationOptions options = modelled({1, 4}, {0.0, 0.2});
  options.utilisation = 0.75;
  options.max_steps = 300;
  for (const AnticipationPoint& point : anticipation(idle_on_cluster(1, 1), options, kQuiet)) {
    EXPECT_FALSE(point.modelled->late);
    EXPECT_LT(point.law, 0);
    EXPECT_EQ(point.modelled->frames.late, 0);
  }
}

// The overloaded world, or the processor that has most of them, decides.
TEST(Anticipation, SeveralModelledWorldsLastAsLongAsTheSlowestOne) {
  const struct {
    std::uint32_t worlds;
    unsigned processors;
    std::vector<models::WorldId> slow;
    double ratio;
  } cases[] = {{3, 3, {models::WorldId{1}}, 2.0},
               {12, 12, {models::WorldId{0}, models::WorldId{7}}, 2.0},
               {12, 4, {models::WorldId{5}}, 4.0 / 3.0},
               {12, 4, {models::WorldId{4}, models::WorldId{5}, models::WorldId{9}}, 5.0 / 3.0},
               {3, 2, {models::WorldId{2}}, 1.0},
               {100, 10, {}, 2.0}};
  for (const auto& c : cases) {
    AnticipationOptions options = modelled({12, 48}, {1.0});
    options.peak.worlds = c.slow;
    options.max_steps = 400;
    const scenarios::Scenario scenario = idle_on_cluster(c.worlds, c.processors);
    EXPECT_NEAR(ratio_of(scenario, options, 1.0), c.ratio, 1e-12);
    for (const AnticipationPoint& point : anticipation(scenario, options, kQuiet)) {
      const AnticipationRun& run = *point.modelled;
      EXPECT_EQ(run.filled, point.buffer);
      const std::int64_t law = law_steps(point.buffer, c.ratio);
      EXPECT_EQ(run.late, law >= 0) << c.worlds << " on " << c.processors;
      if (law >= 0) EXPECT_NEAR(static_cast<double>(run.steps), static_cast<double>(law), 1.0);
    }
  }
}

TEST(Anticipation, ABufferOf48CarriesASecondAt150PercentAndFillsAgain) {
  AnticipationOptions options = modelled({48, 8}, {0.5});
  options.peak.for_s = 1.0;
  options.max_steps = 400;
  const std::vector<AnticipationPoint> points =
      anticipation(idle_on_cluster(3, 3), options, kQuiet);
  EXPECT_FALSE(points[0].modelled->late);
  EXPECT_EQ(points[0].modelled->frames.late, 0);
  EXPECT_NEAR(static_cast<double>(points[0].modelled->frames.least_fill), 48 - 20, 1.0);
  EXPECT_TRUE(std::isnan(points[0].modelled->recovery_s))
      << "with a base load of 1 nothing is left";
  EXPECT_TRUE(points[1].modelled->late);
  options.utilisation = 0.8;
  options.overloads = {0.875};  // 150 % of the time again
  const AnticipationRun recovers =
      *anticipation(idle_on_cluster(3, 3), options, kQuiet)[0].modelled;
  // Twenty entries at a quarter more than one a frame.
  EXPECT_NEAR(recovers.recovery_s, 20 / 0.25 / 60, 0.1);
}

TEST(Anticipation, AWanderingPeakIsTheSameTwiceAndOverloadsNobodyTwiceAsLong) {
  AnticipationOptions options = modelled({48}, {0.5});
  options.peak.wandering = 7;
  options.max_steps = 600;
  const auto run = [&] {
    return *anticipation(idle_on_cluster(4, 4), options, kQuiet)[0].modelled;
  };
  const AnticipationRun first = run(), second = run();
  EXPECT_EQ(first.frames.least_fill, second.frames.least_fill);
  EXPECT_EQ(first.steps, second.steps);
  EXPECT_EQ(first.late, second.late);
  EXPECT_LT(first.frames.least_fill, 48 - 10) << "somebody was overloaded";
}

// By the wall clock: of a busy machine only what the law says of its own ratio.
TEST(Anticipation, MeasuredWorldsMeetTheLawForTheirOwnRatio) {
  scenarios::Scenario scenario = idle_scene(3);
  scenario.run.executor = models::ExecutorKind::kThreads;
  scenario.run.threads = 2;
  AnticipationOptions options;
  options.buffers = {12};
  options.overloads = {3.0};
  options.modelled = false;
  options.utilisation = 0.5;
  options.peak.from_s = 0.2;
  options.max_steps = 120;
  const AnticipationRun run = *anticipation(scenario, options, kQuiet)[0].measured;
  if (run.late_before || std::isnan(run.ratio))
    GTEST_SKIP() << "the machine is too busy to fill a buffer, or to make two steps of the peak";
  ASSERT_TRUE(run.late);
  EXPECT_GT(run.ratio, 1.5);
  EXPECT_GT(run.filled, 0);
  EXPECT_LE(run.steps, run.law + 3) << "nothing lasts longer than what was in store";
}

TEST(Anticipation, PeaksAreReadOrRefused) {
  EXPECT_EQ(peak_of("0,2@1.5+2", 3).worlds.size(), 2u);
  EXPECT_EQ(peak_of("0,2@1.5+2", 3).from_s, 1.5);
  EXPECT_EQ(peak_of("0,2@1.5+2", 3).for_s, 2.0);
  EXPECT_TRUE(peak_of("all@0", 3).worlds.empty());
  EXPECT_TRUE(std::isinf(peak_of("all@0", 3).for_s));
  EXPECT_EQ(peak_of("random:9", 3).wandering, 9u);
  for (const char* bad : {"", "all", "3@1", "0,@1", "x@1", "0@", "0@1+", "0@-1", "0@1+0", "0@nan",
                          "random:", "random:x", "0@1+nan"})
    EXPECT_THROW(peak_of(bad, 3), UsageError) << bad;
}

TEST(Anticipation, TheKneeIsTheSmallestBufferThatIsNearlyTheFastest) {
  const std::vector<BufferCost> costs = {{.buffer = 48, .makespan_s = 77.0},
                                         {.buffer = 1, .makespan_s = 114.0},
                                         {.buffer = 2, .makespan_s = 78.0},
                                         {.buffer = 8, .makespan_s = 77.0}};
  EXPECT_EQ(knee_of(costs), 2);
  EXPECT_EQ(knee_of(costs, 0.0), 8);
}

TEST(SvgPlot, DrawsEachPointInsideItsAxesOnce) {
  Plot plot;
  plot.x_max = 2.0;
  plot.y_max = 10.0;
  plot.series = {{"a < b", false, {{0.5, 1.0}, {1.0, 5.0}, {3.0, 5.0}}}};
  const std::string svg = svg_plot(plot);
  std::size_t circles = 0;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos;
       at = svg.find("<circle", at + 1)) {
    ++circles;
  }
  EXPECT_EQ(circles, 2u);
  EXPECT_NE(svg.find("a &lt; b"), std::string::npos);
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
}

}  // namespace
}  // namespace soda::analysis
