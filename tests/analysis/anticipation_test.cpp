#include "analysis/anticipation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/svg_plot.hpp"

namespace soda::analysis {
namespace {

StarvationResult drain_constant(std::int64_t buffer, double base_s, double peak_s,
                                std::int64_t max_frames = 10000) {
  return drain(
      buffer, 1.0, 60, max_frames, [=] { return base_s; }, [=] { return peak_s; });
}

TEST(Anticipation, ClosedFormGivesThePapersFactsTable) {
  EXPECT_DOUBLE_EQ(anticipation_steps(48, 1.1), 48 * 1.1 / (1.1 - 1.0));
  EXPECT_NEAR(anticipation_steps(48, 1.1), 528, 1e-9);
  EXPECT_NEAR(anticipation_steps(48, 1.25), 240, 1e-9);
  EXPECT_NEAR(anticipation_steps(48, 1.5), 144, 1e-9);
  EXPECT_NEAR(anticipation_steps(48, 2.0), 96, 1e-9);
  EXPECT_NEAR(anticipation_steps(48, 4.0), 64, 1e-9);
  EXPECT_TRUE(std::isinf(anticipation_steps(48, 1.0)));
  EXPECT_TRUE(std::isinf(anticipation_steps(48, 0.5)));
}

TEST(Anticipation, ProducerAndConsumerStarveWithinOneStepOfTheClosedForm) {
  for (const std::int64_t buffer : {1, 2, 12, 48, 200}) {
    for (const double ratio : {1.0625, 1.25, 1.5, 2.0, 2.5, 4.0, 11.0}) {
      const StarvationResult result = drain_constant(buffer, 0.75, ratio);
      ASSERT_TRUE(result.late) << buffer << " " << ratio;
      EXPECT_EQ(result.filled_at_peak, buffer);
      const double law = anticipation_steps(static_cast<double>(buffer), ratio);
      EXPECT_LE(static_cast<double>(result.frames), law) << buffer << " " << ratio;
      EXPECT_GT(static_cast<double>(result.frames), law - 1.0 - 1e-9) << buffer << " " << ratio;
    }
  }
}

TEST(Anticipation, AWorldThatKeepsUpIsNeverLate) {
  for (const double ratio : {0.25, 0.75, 1.0}) {
    const StarvationResult result = drain_constant(4, 0.5, ratio);
    EXPECT_FALSE(result.late) << ratio;
    EXPECT_EQ(result.frames, 10000);
  }
}

TEST(Anticipation, ATooSlowWarmUpIsSeenAsALowFill) {
  const StarvationResult result = drain_constant(48, 1.25, 2.0);
  EXPECT_TRUE(result.late);
  EXPECT_LT(result.filled_at_peak, 48);
}

TEST(Anticipation, RealStepsMeetTheLawForTheirOwnRatio) {
  AnticipationOptions options;
  options.buffers = {4, 12};
  // Far from the limits, so that a busy machine neither starves the warm-up nor keeps up.
  options.overloads = {3.0};
  options.utilisation = 0.5;
  const AnticipationReport report = measure_anticipation(options);
  ASSERT_EQ(report.points.size(), 2u);
  EXPECT_GT(report.base_step_s, 0.0);
  EXPECT_DOUBLE_EQ(report.frame_s, report.base_step_s / 0.5);
  for (const AnticipationPoint& point : report.points) {
    EXPECT_GT(point.bodies, 40u);
    ASSERT_TRUE(point.late);
    EXPECT_GT(point.ratio, 1.0);
    // The law knows the mean cost only; single steps differ by what the machine does meanwhile.
    EXPECT_NEAR(static_cast<double>(point.steps_until_late), point.closed_form_steps,
                2.0 + 0.25 * point.closed_form_steps);
  }
  EXPECT_GT(report.points[1].steps_until_late, report.points[0].steps_until_late);
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
