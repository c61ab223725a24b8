// `soda run` in accuracy mode, through the binary.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;
using Json = nlohmann::json;

// Pairs of slabs that slide over a floor, across the border of two cells, and stop.
std::string scene(const std::string& accuracy) {
  Json json = {
      {"format", 1},
      {"gravity_m_s2", {0, 0, -9.81}},
      {"time_step_s", 1.0 / 60.0},
      {"steps", 40},
      {"materials", {{{"name", "stuff"}, {"friction", 0.5}, {"restitution", 0}}}},
      {"statics",
       {{{"name", "floor"},
         {"shape", {{"type", "halfspace"}, {"normal", {0, 0, 1}}, {"offset_m", 0}}},
         {"material", "stuff"}}}},
      {"territory",
       {{"origin_m", {-4, -4, 0}}, {"cell_size_m", 4}, {"cells", {2, 2, 1}}, {"worlds", 4}}}};
  for (int i = 0; i < 6; ++i)
    json["bodies"].push_back({{"id", i + 1},
                              {"shape", {{"type", "box"}, {"size_m", {0.6, 0.6, 0.2}}}},
                              {"mass_kg", 1.0},
                              {"material", "stuff"},
                              {"position_m", {-0.5, 1.5 * (i / 2) - 1.5, 0.1 + 0.2 * (i % 2)}},
                              {"velocity_m_s", {2.0 + 0.3 * i, 0, 0}}});
  if (!accuracy.empty()) json["accuracy"] = Json::parse(accuracy);
  return json.dump();
}

TEST(AccuracyMode, TellsTheSameEstimatesForEveryExecutor) {
  const TemporaryFolder folder;
  const std::string file = folder.file("slabs.json");
  write_file(file, scene(R"({"tolerance": 1e-6})"));
  const ChildResult oracle =
      run_soda({"run", file, "--executor", "sequential", "--worlds", "1", "--json"});
  ASSERT_EQ(oracle.exit_code, 0) << oracle.err;
  const Json expected = Json::parse(oracle.out);
  EXPECT_GT(expected["accuracy"]["largest"], 0.0);
  EXPECT_GE(expected["accuracy"]["sum"], expected["accuracy"]["largest"]);
  EXPECT_EQ(expected["accuracy"]["islands"], expected["islands"]["committed"]);
  std::uint64_t rolled_back = 0;
  for (const char* seed : {"1", "2", "3"})
    for (const char* buffer : {"1", "40"}) {
      const ChildResult result =
          run_soda({"run", file, "--executor", "virtual", "--buffer", buffer, "--jitter-us", "50",
                    "--execution-seed", seed, "--json"});
      ASSERT_EQ(result.exit_code, 0) << result.err;
      const Json json = Json::parse(result.out);
      EXPECT_EQ(json["digest"], expected["digest"]);
      EXPECT_EQ(json["accuracy"], expected["accuracy"]);
      rolled_back += json["events"]["rolled_back"].get<std::uint64_t>();
    }
  EXPECT_GT(rolled_back, 0u) << "nothing was proved";
}

TEST(AccuracyMode, NamesTheWorstStepAndCountsWhatIsBeyondTheTolerance) {
  const TemporaryFolder folder;
  const std::string file = folder.file("slabs.json");
  write_file(file, scene(R"({"tolerance": 1e-4})"));
  const ChildResult text = run_soda({"run", file});
  EXPECT_TRUE(contains(text.out, "error estimates, of a body's width: largest of a step "))
      << text.out;
  EXPECT_TRUE(contains(text.out, "islands beyond the tolerance of 0.0001")) << text.out;
}

TEST(AccuracyMode, IsNotMentionedUnlessItIsAskedFor) {
  const TemporaryFolder folder;
  const std::string file = folder.file("slabs.json");
  write_file(file, scene(""));
  EXPECT_FALSE(contains(run_soda({"run", file}).out, "estimate"));
  EXPECT_FALSE(Json::parse(run_soda({"run", file, "--json"}).out).contains("accuracy"));
}

TEST(AccuracyMode, AToleranceOutOfRangeIsLocated) {
  const TemporaryFolder folder;
  const std::string file = folder.file("slabs.json");
  write_file(file, scene(R"({"tolerance": 1})"));
  const ChildResult result = run_soda({"run", file});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(contains(result.err, "/accuracy/tolerance: found 1; allowed: ")) << result.err;
}

}  // namespace
}  // namespace soda::analysis
