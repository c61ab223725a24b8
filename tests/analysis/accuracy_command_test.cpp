// `soda accuracy` through the binary.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using Json = nlohmann::json;

ChildResult accuracy(std::vector<std::string> more) {
  more.insert(more.begin(), {"accuracy", "--cases", SODA_SOURCE_DIR "/scenarios/cases"});
  return run_soda(more);
}

TEST(AccuracyCommand, CheckFailsExactlyIfAMustIsMissed) {
  const ChildResult good = accuracy({"free-fall", "--check", "--repeat", "0"});
  EXPECT_EQ(good.exit_code, 0) << good.out;
  EXPECT_TRUE(contains(good.out, "0 missed of 1")) << good.out;
  const std::vector<std::string> coarse = {"stop", "--tolerance", "1e-3", "--repeat", "0"};
  std::vector<std::string> checked = coarse;
  checked.push_back("--check");
  const ChildResult poor = accuracy(checked);
  EXPECT_EQ(poor.exit_code, 1) << poor.out;
  EXPECT_TRUE(contains(poor.out, " missed")) << poor.out;
  EXPECT_EQ(accuracy(coarse).exit_code, 0);
}

TEST(AccuracyCommand, JsonHasEveryDocumentedKey) {
  const ChildResult result = accuracy({"bounce", "--dt", "1/60,0.01", "--json", "--repeat", "1"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  for (const char* key :
       {"/missed", "/missing_engines", "/cases/0/case", "/cases/0/left_out",
        "/cases/0/runs/0/engine", "/cases/0/runs/0/dt_s", "/cases/0/runs/0/iterations",
        "/cases/0/runs/0/tolerance", "/cases/0/runs/0/estimates", "/cases/0/runs/0/steps",
        "/cases/0/runs/0/cpu_s_per_simulated_s", "/cases/0/runs/0/step_ms", "/cases/0/runs/0/fault",
        "/cases/0/runs/0/errors/0/reference", "/cases/0/runs/0/errors/0/measure",
        "/cases/0/runs/0/errors/0/value", "/cases/0/runs/0/errors/0/must",
        "/cases/0/runs/0/errors/0/stretch", "/cases/0/runs/0/errors/0/missed"})
    EXPECT_TRUE(json.contains(Json::json_pointer(key))) << key;
  EXPECT_EQ(json["cases"][0]["runs"][1]["steps"], 350);
}

TEST(AccuracyCommand, UsageErrorsExitWith2AndSayWhatIsAllowed) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"free-fal"}, "did you mean free-fall?"},
      {{"free-fall", "--dt", "1/0"}, "--dt"},
      {{"free-fall", "--dt", "two"}, "--dt"},
      {{"free-fall", "--dt", "2"}, "--dt"},
      {{"free-fall", "--iterations", "0"}, "--iterations"},
      {{"free-fall", "--tolerance", "0.1"}, "--tolerance: found 0.1; allowed: 1e-12 to 0.01"},
      {{"free-fall", "--engines", "havok"}, "--engines"},
      {{"free-fall", "--repeat", "-1"}, "--repeat"},
      {{"free-fall", "--budget", "-1"}, "--budget"},
      {{library_file("pyramid")}, "no references"},
  };
  for (const auto& [arguments, part] : cases) {
    const ChildResult result = accuracy(arguments);
    EXPECT_EQ(result.exit_code, 2) << part;
    EXPECT_EQ(result.out, "") << part;
    EXPECT_TRUE(contains(result.err, part)) << part << " in:\n" << result.err;
  }
  EXPECT_EQ(run_soda({"accuracy", "--cases", "/nonexistent"}).exit_code, 3);
  EXPECT_EQ(accuracy({"free-fall", "-o", "/nonexistent/report.html"}).exit_code, 3);
}

TEST(AccuracyCommand, WritesAReportWithADiagramOfEachBound) {
  const TemporaryFolder folder;
  const std::string file = folder.file("report.html");
  ASSERT_EQ(accuracy({"slip-0", "--sweep", "--repeat", "1", "-o", file}).exit_code, 0);
  const std::string html = read_file(file);
  std::size_t diagrams = 0;
  for (std::size_t at = html.find("<svg"); at != std::string::npos; at = html.find("<svg", at + 1))
    ++diagrams;
  EXPECT_EQ(diagrams, 4u);  // of the best runs; position_m, side_m, lift_m
  EXPECT_TRUE(contains(html, "1/960"));
}

TEST(AccuracyCommand, ASettingBeyondTheBudgetIsLeftOutAndNamed) {
  const ChildResult result = accuracy({"stack-1", "--sweep", "--repeat", "1", "--budget", "0.01"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "left out: soda at 1/60 s: beyond the time budget"))
      << result.out;
}

TEST(AccuracyCommand, RunsAToleranceInsteadOfTheStepOrBesideIt) {
  const ChildResult instead =
      accuracy({"tip", "--tolerance", "1e-4,1e-8", "--repeat", "0", "--json"});
  ASSERT_EQ(instead.exit_code, 0) << instead.err;
  const Json runs = Json::parse(instead.out)["cases"][0]["runs"];
  ASSERT_EQ(runs.size(), 2u);
  for (const Json& run : runs) {
    EXPECT_EQ(run["dt_s"], 1.0 / 60.0);
    EXPECT_EQ(run["estimates"]["islands"], 18);
    EXPECT_EQ(run["estimates"]["beyond_tolerance"], 0);
    EXPECT_LE(run["estimates"]["largest"], run["tolerance"]);
  }
  EXPECT_LT(runs[1]["errors"][0]["value"], runs[0]["errors"][0]["value"]);
  const TemporaryFolder folder;
  const std::string file = folder.file("report.html");
  const ChildResult beside = accuracy(
      {"tip", "--dt", "1/60,1/120", "--tolerance", "1e-4,1e-8", "--repeat", "1", "-o", file});
  EXPECT_TRUE(contains(beside.out, "estimates of soda at 1/60 s, tolerance 1e-08")) << beside.out;
  EXPECT_FALSE(contains(beside.out, "estimates of soda at 1/120 s")) << beside.out;
  const std::string html = read_file(file);
  EXPECT_TRUE(contains(html, ">soda to tolerance<"));
  EXPECT_TRUE(contains(html, "soda to tolerance tolerance 1e-08: error"));
}

// Whether an engine is there depends on the machine; it is named either way.
TEST(AccuracyCommand, NamesAnEngineThatThisBuildHasNot) {
  const ChildResult result =
      accuracy({"free-fall", "--engines", "soda,bullet", "--repeat", "1", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  const bool built = std::filesystem::exists(SODA_BINARY_DIR "/soda_engine_bullet.so");
  EXPECT_EQ(json["missing_engines"].size(), built ? 0u : 1u);
  EXPECT_EQ(json["cases"][0]["runs"].size(), built ? 2u : 1u);
}

}  // namespace
}  // namespace soda::analysis
