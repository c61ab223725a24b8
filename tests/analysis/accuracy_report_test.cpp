// Reports of `soda accuracy`: what text and page say of made-up runs.
#include "analysis/commands/accuracy_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "analysis/commands/accuracy_command.hpp"
#include "analysis/commands/accuracy_html.hpp"
#include "analysis/commands/accuracy_summary.hpp"

namespace soda::analysis {
namespace {

AccuracyReport::Case made_up_case() {
  AccuracyReport::Case one;
  one.name = "a<b";
  one.description = "made up";
  for (const double dt : {0.02, 0.01, 0.005}) {
    CaseRun run;
    run.scene = one.name;
    run.engine = "soda";
    run.setting.dt_s = dt;
    run.cpu_per_simulated_s = 1e-5 / dt;
    run.measures.push_back({"free-flight", "position_m", 3.0 * dt * dt, 1e-3, {}});
    one.runs.push_back(run);
  }
  return one;
}

TEST(AccuracyReports, MarkWhatIsMissedAndTellTheObservedOrder) {
  AccuracyReport report;
  report.cases.push_back(made_up_case());
  EXPECT_EQ(report.missed(), 1u);
  const std::string text = accuracy_text(report);
  EXPECT_NE(text.find("0.0012 missed"), std::string::npos) << text;
  EXPECT_NE(text.find("order 2.00"), std::string::npos) << text;
  EXPECT_NE(text.find("1 missed of 3"), std::string::npos) << text;
}

TEST(AccuracyReports, NameWhoeverIsFasterAtAnEqualOrSmallerError) {
  AccuracyReport report;
  report.cases.push_back(made_up_case());  // errors 1.2e-3, 3e-4, 7.5e-5 in 5e-4, 1e-3, 2e-3 s/s
  const auto add = [&](const char* engine, double error, double cpu) {
    CaseRun run = report.cases.back().runs.front();
    run.engine = engine;
    run.measures[0].value = error;
    run.cpu_per_simulated_s = cpu;
    report.cases.back().runs.push_back(run);
  };
  add("slower", 3e-4, 1.1e-3);
  add("as-good", 3e-4, 1e-3);
  add("faster", 1e-4, 1e-3);
  add("nearer", 1e-9, 1.0);
  add("broken", std::numeric_limits<double>::quiet_NaN(), 1e-9);
  const std::vector<Advantage> found = advantages_of_others(report);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].engine, "faster");
  EXPECT_EQ(found[0].soda_cpu_per_simulated_s, 1e-5 / 0.005);
  EXPECT_EQ(found[1].engine, "nearer");
  EXPECT_FALSE(found[1].soda_cpu_per_simulated_s);
}

TEST(AccuracyReports, NameWhoeverIsFasterInAllMeasuresOfACase) {
  AccuracyReport report;
  report.cases.push_back(made_up_case());
  for (CaseRun& run : report.cases.back().runs) {
    JudgedMeasure other = run.measures[0];
    other.measure = "gain";
    other.value = 0.0;
    run.measures.push_back(other);
  }
  CaseRun cheap = report.cases.back().runs.front();
  cheap.engine = "other";
  cheap.cpu_per_simulated_s = 1e-5;
  cheap.measures[0].value = 1e-4;
  cheap.measures[1].value = 2e-4;
  report.cases.back().runs.push_back(cheap);
  ASSERT_EQ(advantages_of_others(report).size(), 2u);
  const std::vector<Advantage> found = advantages_in_cases(report);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].error, 2e-4);
  EXPECT_EQ(found[0].measure, "");
  EXPECT_EQ(found[0].soda_cpu_per_simulated_s, 1e-5 / 0.005);
  CaseRun& sloppy = report.cases.back().runs.back();
  sloppy.measures[0].value = 2e-3;
  sloppy.cpu_per_simulated_s = 6e-4;
  EXPECT_EQ(advantages_of_others(report).size(), 0u);
  EXPECT_TRUE(advantages_in_cases(report).empty());
  sloppy.measures[0].value = 1e-3;
  EXPECT_EQ(advantages_of_others(report).size(), 1u);
  ASSERT_EQ(advantages_in_cases(report).size(), 1u);
}

TEST(AccuracyReports, CountRunsToAToleranceAsRunsOfSoda) {
  AccuracyReport report;
  report.cases.push_back(made_up_case());
  CaseRun other = report.cases.back().runs.front(), loose = other;
  other.engine = "faster";
  other.cpu_per_simulated_s = 1e-5;
  report.cases.back().runs.push_back(other);
  ASSERT_EQ(advantages_of_others(report).size(), 1u);
  loose.setting.tolerance = 1e-2;
  loose.cpu_per_simulated_s = 9e-6;
  report.cases.back().runs.push_back(loose);
  EXPECT_TRUE(advantages_of_others(report).empty());
}

// soda reaches the bound from 0.01 s on, in 1e-3 s/s; errors 1.2e-3, 3e-4, 7.5e-5.
TEST(AccuracyReports, SumUpWhoReachesAllBoundsAndAtWhichCost) {
  AccuracyReport report;
  report.cases.push_back(made_up_case());
  CaseRun other = report.cases.back().runs.front();
  other.engine = "other";
  report.cases.back().runs.push_back(other);  // misses
  report.cases.push_back(made_up_case());
  report.cases.back().name = "second";
  other.measures[0].value = 1e-3;
  other.cpu_per_simulated_s = 9e-4;
  report.cases.back().runs.push_back(other);  // reaches, in less time
  CaseRun broken = other;
  broken.measures.push_back({"free-flight", "speed_m_s", std::nan(""), 1.0, {}});
  broken.cpu_per_simulated_s = 1e-9;
  report.cases.back().runs.push_back(broken);
  EXPECT_EQ(best_run(report.cases[0], "soda"), &report.cases[0].runs[1]);
  EXPECT_EQ(best_run(report.cases[0], "nobody"), nullptr);
  const std::vector<EngineSummary> all = engine_summaries(report);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].reached, 2u);
  EXPECT_EQ(all[0].cheapest, 1u);
  EXPECT_EQ(all[0].median_cpu_s, 1e-5 / 0.01);
  EXPECT_EQ(all[1].cases, 2u);
  EXPECT_EQ(all[1].reached, 1u);
  EXPECT_EQ(all[1].cheapest, 1u);
  EXPECT_EQ(all[1].worst_case, "a<b");
  EXPECT_NEAR(all[1].worst_share, 1.2, 1e-12);
}

TEST(AccuracyReports, SharesOfBoundsOfZeroAreZeroOrInfinite) {
  CaseRun run;
  EXPECT_FALSE(largest_share_of_must(run));
  run.measures.push_back({"hits", "passed", 0.0, 0.0, {}});
  EXPECT_EQ(largest_share_of_must(run), 0.0);
  run.measures[0].value = 1.0;
  EXPECT_EQ(largest_share_of_must(run), std::numeric_limits<double>::infinity());
  run.fault = "left the world";
  EXPECT_FALSE(largest_share_of_must(run));
}

TEST(AccuracyReports, HtmlIsOneFileWithoutScripts) {
  AccuracyReport report;
  report.cases.push_back(made_up_case());
  report.cases.back().runs[1].measures[0].value = std::numeric_limits<double>::quiet_NaN();
  const std::string html = accuracy_html(report, "soda accuracy a<b");
  EXPECT_NE(html.find("a&lt;b"), std::string::npos);
  EXPECT_NE(html.find("<polyline"), std::string::npos);
  EXPECT_NE(html.find("<code>soda accuracy a&lt;b</code>"), std::string::npos);
  EXPECT_NE(html.find("href=\"#a&lt;b\""), std::string::npos);
  EXPECT_NE(html.find("id=\"a&lt;b\""), std::string::npos);
  for (const char* outside : {"<script", "src=", "url(", "nan,", ",nan"})
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  for (std::size_t at = html.find("href="); at != std::string::npos;
       at = html.find("href=", at + 1))
    EXPECT_EQ(html.substr(at, 7), "href=\"#") << "a link leaves the page";
}

}  // namespace
}  // namespace soda::analysis
