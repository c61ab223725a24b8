// Families over n: their laws at a few n, and what counts as a miss. All n: `soda accuracy
// --families`.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <sstream>

#include "analysis/families/family_run.hpp"

namespace soda::analysis {
namespace {

// That family at these n, with the series that have this in their names.
Family part_of(const std::string& name, const std::string& series, std::vector<int> sizes) {
  for (Family& family : all_families()) {
    if (family.name != name) continue;
    std::erase_if(family.series, [&](const FamilySeries& one) {
      return one.name.find(series) == std::string::npos;
    });
    family.sizes = std::move(sizes);
    family.full_sizes.clear();
    return family;
  }
  return {};
}

FamilyReport measured(const Family& family) {
  FamilyRequest request;
  request.timing.repeats = 0;
  std::ostringstream progress;
  return measure_families({family}, request, progress).families.at(0);
}

void expect_smooth(const Family& family) {
  const FamilyReport report = measured(family);
  EXPECT_FALSE(report.series.empty());
  for (const FamilySeriesReport& series : report.series) {
    EXPECT_EQ(series.runs.size(), family.sizes.size());
    EXPECT_EQ(series.left_out, "");
    for (const FamilyMiss& miss : series.misses)
      ADD_FAILURE() << family.name << ", " << series.name << ": " << name_of(miss.kind) << " "
                    << miss.measure << " n " << miss.from_n << " to " << miss.n << ": " << miss.from
                    << " to " << miss.to << " " << miss.what;
  }
}

TEST(Families, ElasticBallsPassAMomentumOnWhateverTheirNumberAndMasses) {
  for (const char* row : {"balls-flight", "balls-floor"}) {
    expect_smooth(part_of(row, "touching e 1", {7, 8, 9, 16, 32, 64, 65}));
    expect_smooth(part_of(row, "spaced e 1", {7, 8, 9, 16, 32, 64, 65}));
  }
}

TEST(Families, BoxesSideBySideStopWhereOneDoes) {
  expect_smooth(part_of("sliding-row", "beside", {7, 8, 9}));
}

TEST(Families, StacksStand) { expect_smooth(part_of("stack", "", {7, 8, 9, 20})); }

TEST(Families, ChainsKeepTheirJointsAndEnergy) {
  expect_smooth(part_of("hanging-chain", "", {7, 8, 9}));
  expect_smooth(part_of("lying-chain", "equal", {9, 10, 12}));
  expect_smooth(part_of("star", "", {7, 8, 9}));
}

// Errors are told, not made: what the judge sees of a scene that does not keep its law.
TEST(Families, AnErrorIsSeen) {
  Family family = part_of("stack", "equal", {3});
  const auto build = family.series.at(0).build;
  family.series[0].build = [build](int n) {
    FamilyScene scene = build(n);
    scene.states.back().linear_velocity_m_s = physics::Vec3(0.5, 0, 0);
    return scene;
  };
  const FamilyReport report = measured(family);
  EXPECT_GT(report.series.at(0).runs.at(0).errors.at(0), 0.01);
  EXPECT_FALSE(report.series[0].misses.empty());
}

TEST(Families, AnAbsurdBoundIsMissed) {
  Family family = part_of("sliding-row", "beside, mu .3", {2, 3});
  family.measures[0].bound = -1.0;
  const FamilyReport report = measured(family);
  ASSERT_EQ(report.series.at(0).misses.size(), 2u);
  EXPECT_EQ(report.series[0].misses[0].kind, FamilyFinding::kBeyondBound);
  EXPECT_EQ(report.series[0].misses[0].measure, "stopping place off, m");
}

TEST(Families, WhatIsBeyondTheBudgetIsLeftOutAndSaid) {
  const Family family = part_of("stack", "equal", {2, 3});
  FamilyRequest request;
  request.timing.budget_s = 0.0;
  std::ostringstream progress;
  const FamiliesReport report = measure_families({family}, request, progress);
  EXPECT_TRUE(report.families.at(0).series.at(0).runs.empty());
  EXPECT_EQ(report.families[0].series[0].left_out, "n from 2 on: beyond the time budget");
  EXPECT_NE(families_text(report).find("left out: n from 2 on"), std::string::npos);
}

FamilyRun run_of(int n, double error, double work) {
  FamilyRun run;
  run.n = n;
  run.errors = {error};
  run.work = work;
  return run;
}

TEST(Families, JumpsCountAboveTheFloorAndInBothDirections) {
  const std::vector<FamilyMeasure> measures{{"way, m", "", 1e-3, 1e-6, "none"}};
  const auto misses = [&](const std::vector<FamilyRun>& runs) {
    return family_misses(measures, runs);
  };
  EXPECT_TRUE(misses({run_of(2, 0.0, 10), run_of(3, 1.9e-6, 900)}).empty());
  EXPECT_TRUE(misses({run_of(2, 1e-4, 5000), run_of(3, 1.9e-4, 9900)}).empty());
  const std::vector<FamilyMiss> up = misses({run_of(8, 0.0, 5000), run_of(9, 2.1e-6, 10100)});
  ASSERT_EQ(up.size(), 2u);
  EXPECT_EQ(up[0].kind, FamilyFinding::kErrorJump);
  EXPECT_EQ(up[0].from_n, 8);
  EXPECT_EQ(up[0].n, 9);
  EXPECT_EQ(up[1].kind, FamilyFinding::kWorkJump);
  EXPECT_EQ(misses({run_of(8, 2.1e-6, 10100), run_of(9, 0.0, 5000)}).size(), 2u);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ASSERT_EQ(misses({run_of(8, nan, 0)}).size(), 1u);
  EXPECT_EQ(misses({run_of(8, nan, 0)})[0].kind, FamilyFinding::kBeyondBound);
  FamilyRun faulty = run_of(9, 0.0, 0);
  faulty.fault = "step 3: spin not finite";
  EXPECT_EQ(misses({run_of(8, 0.0, 0), faulty})[0].kind, FamilyFinding::kFault);
}

TEST(Families, AreWholeAndTheirPicturesShowEachMeasure) {
  std::set<std::string> names;
  FamiliesReport report;
  for (const Family& family : all_families()) {
    names.insert(family.name);
    EXPECT_TRUE(std::ranges::is_sorted(family.sizes)) << family.name;
    EXPECT_TRUE(std::ranges::is_sorted(family.full_sizes)) << family.name;
    EXPECT_LT(family.sizes.back(), family.full_sizes.front()) << family.name;
    for (const FamilyMeasure& measure : family.measures) {
      EXPECT_LT(measure.floor, measure.bound) << family.name;
      EXPECT_FALSE(measure.floor_reason.empty()) << family.name;
    }
  }
  EXPECT_EQ(names, (std::set<std::string>{"balls-flight", "balls-floor", "sliding-row", "stack",
                                          "pile", "hanging-chain", "lying-chain", "star", "grid"}));
  report.families.push_back(measured(part_of("stack", "equal", {1, 2})));
  const std::string html = families_html(report, "soda accuracy --families a<b");
  EXPECT_NE(html.find("stack: way of a box, of its width"), std::string::npos);
  EXPECT_NE(html.find("stack: work per body and step"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace soda::analysis
