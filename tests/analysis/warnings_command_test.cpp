// Warnings of a scenario, as every command that reads one tells them.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::contains;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;

// A ball that starts beneath the floor, and falls.
constexpr const char* kSunken = R"({
  "format": 1, "gravity_m_s2": [0, 0, -10], "time_step_s": 0.01, "steps": 3,
  "materials": [{"name": "wood", "friction": 0.5, "restitution": 0}],
  "bodies": [
    {"id": 7, "shape": {"type": "sphere", "radius_m": 0.5}, "mass_kg": 1, "material": "wood",
     "position_m": [0, 0, -2]}],
  "statics": [{"name": "floor", "shape": {"type": "halfspace"}, "material": "wood"}],
  "references": [{"type": "conserved"}]
})";

class WarningsCommand : public testing::Test {
 protected:
  WarningsCommand() { analysis_test::write_file(file_, kSunken); }

  // Commands that read the file and end at once.
  std::vector<std::vector<std::string>> commands() const {
    return {{"run", file_, "--quiet"},
            {"plan", file_},
            {"verify", file_, "--worlds", "1", "--seeds", "1", "--threads", "1"},
            {"compare", file_},
            {"swarm", file_, "--seeds", "1..1"},
            {"fuzz", file_},
            {"accuracy", file_, "--repeat", "0"}};
  }

  TemporaryFolder folder_;
  std::string file_ = folder_.file("sunken.json");
};

TEST_F(WarningsCommand, AreToldOnStandardErrorWithTheirPlace) {
  for (const auto& command : commands()) {
    const auto result = run_soda(command);
    EXPECT_TRUE(contains(result.err, file_ + ":5:5: /bodies/0: warning below-floor: found body 7 "
                                             "with its centre 2 m beneath static \"floor\""))
        << command[0] << ": " << result.err;
    EXPECT_FALSE(contains(result.out, "warning")) << command[0];
    EXPECT_NE(result.exit_code, 2) << command[0];
  }
}

TEST_F(WarningsCommand, AreAnArrayInJson) {
  for (auto command : commands()) {
    command.push_back("--json");
    const auto result = run_soda(command);
    const auto json = nlohmann::json::parse(result.out);
    ASSERT_EQ(json.at("warnings").size(), 1u) << command[0];
    const auto& warning = json["warnings"][0];
    EXPECT_EQ(warning["kind"], "below-floor");
    EXPECT_EQ(warning["file"], file_);
    EXPECT_EQ(warning["line"], 5);
    EXPECT_EQ(warning["pointer"], "/bodies/0");
    EXPECT_EQ(warning["more"], 0);
    EXPECT_FALSE(warning["likely"].get<std::string>().empty());
  }
}

TEST_F(WarningsCommand, AreErrorsIfStrictAndNothingIsRun) {
  for (auto command : commands()) {
    command.push_back("--strict");
    const auto result = run_soda(command);
    EXPECT_EQ(result.exit_code, 2) << command[0];
    EXPECT_EQ(result.out, "") << command[0];
    EXPECT_TRUE(contains(result.err, file_ + ":5:5: /bodies/0: found body 7"))
        << command[0] << ": " << result.err;
  }
}

TEST_F(WarningsCommand, OfALoggedScenarioAreToldAgain) {
  const std::string log = folder_.file("run.sodalog");
  ASSERT_EQ(run_soda({"run", file_, "--quiet", "--log", log}).exit_code, 0);
  const auto again = run_soda({"replay", log, "--quiet"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(contains(again.err, "warning below-floor")) << again.err;
  EXPECT_TRUE(contains(run_soda({"view", log}).err, "warning below-floor"));
  EXPECT_EQ(run_soda({"replay", log, "--strict"}).exit_code, 2);
}

TEST_F(WarningsCommand, AreNoneOfAGoodSceneWhichStrictRuns) {
  const std::string scene = analysis_test::library_file("border-stack");
  const auto result = run_soda({"run", scene, "--steps", "2", "--strict", "--json", "--quiet"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_TRUE(nlohmann::json::parse(result.out).at("warnings").empty());
}

TEST_F(WarningsCommand, OfSodasOwnCasesAreInJsonAlone) {
  const auto own = run_soda({"accuracy", "coincident", "--repeat", "0", "--json"});
  EXPECT_FALSE(contains(own.err, "warning")) << own.err;
  EXPECT_EQ(nlohmann::json::parse(own.out).at("warnings").size(), 3u);
  const std::string copy = folder_.file("coincident.json");
  std::filesystem::copy(SODA_SOURCE_DIR "/scenarios/cases/coincident.json", copy);
  EXPECT_TRUE(contains(run_soda({"accuracy", copy, "--repeat", "0"}).err, "warning overlap"));
}

TEST_F(WarningsCommand, ThatTheyWereErrorsIsInTheLog) {
  const std::string scene = analysis_test::library_file("border-stack");
  const std::string log = folder_.file("run.sodalog"), lax = folder_.file("lax.sodalog");
  ASSERT_EQ(run_soda({"run", scene, "--steps", "2", "--strict", "--log", log}).exit_code, 0);
  ASSERT_EQ(run_soda({"run", scene, "--steps", "2", "--log", lax}).exit_code, 0);
  EXPECT_EQ(run_soda({"replay", log}).exit_code, 0);
  const auto settings =
      nlohmann::json::parse(run_soda({"diff", log, lax, "--json"}).out)["settings"];
  ASSERT_EQ(settings.size(), 1u) << settings;
  EXPECT_EQ(settings[0]["name"], "warnings are errors");
  EXPECT_EQ(settings[0]["first"], "on");
}

}  // namespace
}  // namespace soda::analysis
