// A box at rest at the ends of all ranges. The whole product: `soda accuracy --extremes`.
#include "analysis/measures/extremes.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

namespace soda::analysis {
namespace {

TEST(Extremes, ABoxAtRestStaysAtEveryCornerOfTheProduct) {
  std::vector<ExtremeSetting> settings;
  for (const double size : {1e-3, 1.0, 1e3})
    for (const double dt : {0.1, 1.0 / 60.0, 1e-3})
      for (const double offset : {0.0, 1e7})
        for (const double mass : {1e-9, 1e9}) settings.push_back({size, dt, offset, mass});
  for (const ExtremeRun& run : measure_extremes(settings).runs) {
    EXPECT_EQ(run.fault, "");
    EXPECT_LE(run.displacement_rel, kExtremesMust)
        << run.setting.size_m << " m, " << run.setting.dt_s << " s, " << run.setting.offset_m
        << " m, " << run.setting.mass_kg << " kg";
  }
}

TEST(Extremes, TheProductIsWhole) {
  std::set<double> sizes, steps, offsets, masses;
  const std::vector<ExtremeSetting> settings = extreme_settings();
  for (const ExtremeSetting& s : settings) {
    sizes.insert(s.size_m);
    steps.insert(s.dt_s);
    offsets.insert(s.offset_m);
    masses.insert(s.mass_kg);
  }
  EXPECT_EQ(settings.size(), sizes.size() * steps.size() * offsets.size() * masses.size());
  EXPECT_EQ(*sizes.begin(), 1e-3);
  EXPECT_EQ(*sizes.rbegin(), 1e3);
  EXPECT_EQ(*steps.begin(), 1e-4);
  EXPECT_EQ(*steps.rbegin(), 0.1);
  EXPECT_EQ(*offsets.rbegin(), 1e7);
  EXPECT_EQ(*masses.begin(), 1e-9);
  EXPECT_EQ(*masses.rbegin(), 1e9);
}

TEST(Extremes, AMissIsCountedAndNamed) {
  ExtremesReport report;
  report.runs.push_back({{1.0, 0.1, 0.0, 1.0}, 20, 2e-3, ""});
  report.runs.push_back({{1.0, 0.1, 1e7, 1.0}, 20, 0.0, "step 3: spin not finite"});
  report.runs.push_back({{10.0, 0.1, 0.0, 1.0}, 20, 1e-5, ""});
  report.runs.push_back({{10.0, 0.1, 0.0, 2.0}, 20, std::numeric_limits<double>::quiet_NaN(), ""});
  EXPECT_EQ(report.beyond(kExtremesMust), 3u);
  EXPECT_EQ(report.beyond(kExtremesStretch), 4u);
  const std::string text = extremes_text(report);
  EXPECT_NE(text.find("missed: 1 m, steps of 0.1 s, at 0 m, 1 kg: 0.002"), std::string::npos)
      << text;
  EXPECT_NE(text.find("spin not finite"), std::string::npos) << text;
  EXPECT_NE(text.find("4 runs, 3 beyond 0.001 (must), 4 beyond 1e-06 (stretch)"), std::string::npos)
      << text;
}

}  // namespace
}  // namespace soda::analysis
