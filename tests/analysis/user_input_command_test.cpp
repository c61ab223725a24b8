// User input by way of the program: from a scenario, a file and a stream; logged, replayed,
// reported.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <map>
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
using analysis_test::write_file;
using Json = nlohmann::json;

std::string scene() { return library_file("user-input"); }

std::string digest_in(const std::string& json) { return Json::parse(json)["digest"]; }

TEST(UserInputCommand, ReportsWhatHadNoEffect) {
  const ChildResult text = run_soda({"run", scene(), "--steps", "30", "--quiet"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_TRUE(contains(text.out, "input 1 (push body 21, step 2) had no effect")) << text.out;
  const Json json = Json::parse(run_soda({"run", scene(), "--steps", "30", "--json"}).out);
  EXPECT_EQ(json["inputs"].size(), 8u);
  EXPECT_EQ(json["inputs_too_late"], 3);
  EXPECT_EQ(json["inputs"][0]["had_effect"], false);
  EXPECT_EQ(json["inputs"][3]["type"], "add");
  EXPECT_EQ(json["inputs"][3]["had_effect"], true);
}

// Pushes, comings and goings are no drift.
TEST(UserInputCommand, MomentumIsMeasuredWithoutWhatTheUserAdds) {
  const Json json = Json::parse(run_soda({"run", scene(), "--steps", "100", "--json"}).out);
  EXPECT_LT(json["error"]["momentum_drift_rel"].get<double>(), 1e-13);
}

TEST(UserInputCommand, InputsOfAFileAreThoseOfTheScenario) {
  const TemporaryFolder folder;
  Json scenario = Json::parse(read_file(scene()));
  std::string lines;
  for (const Json& input : scenario["inputs"]) lines += input.dump() + "\n\n";
  scenario.erase("inputs");
  write_file(folder.file("scene.json"), scenario.dump());
  write_file(folder.file("lines.jsonl"), lines);
  const std::string expected = digest_in(run_soda({"run", scene(), "--steps", "60", "--json"}).out);
  const ChildResult found = run_soda({"run", folder.file("scene.json"), "--steps", "60", "--inputs",
                                      folder.file("lines.jsonl"), "--json"});
  EXPECT_EQ(digest_in(found.out), expected) << found.err;
}

TEST(UserInputCommand, ARunWithInputsIsReplayedFromItsLogAlone) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog"), lines = folder.file("lines.jsonl");
  write_file(lines, R"({"id": 50, "type": "push", "body": 3, "impulse_newton_s": [40, 0, 0]})");
  const ChildResult run = run_soda({"run", scene(), "--steps", "50", "--threads", "2", "--inputs",
                                    lines, "--log", log, "--quiet"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* worlds : {"1", "12"}) {
    const ChildResult replay = run_soda({"replay", log, "--worlds", worlds});
    EXPECT_EQ(replay.exit_code, 0) << replay.err;
    EXPECT_TRUE(contains(replay.out, "50 steps replayed without divergence")) << replay.out;
  }
  EXPECT_TRUE(contains(run_soda({"replay", log, "--step", "25", "--body", "2"}).out, "not there"));
}

// What came while the run went on, and when it acted, is in the log.
TEST(UserInputCommand, WhatAStreamDidIsReplayedFromTheLogAtTheStepsAtWhichItActed) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog"), lines = folder.file("lines.jsonl");
  write_file(lines, R"({"id": 50, "type": "push", "body": 3, "impulse_newton_s": [40, 0, 0]}
{"id": 51, "type": "push", "body": 4, "impulse_newton_s": [0, 40, 0], "step": 300}
)");
  const ChildResult run =
      run_soda({"run", scene(), "--steps", "400", "--threads", "2", "--inputs", "-", "--log", log,
                "--json", "--quiet"},
               {[lines] { dup2(open(lines.c_str(), O_RDONLY), STDIN_FILENO); }, [](int) {}});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::map<int, int> steps, logged;
  const Json told = Json::parse(run.out);
  for (const Json& input : told["inputs"]) steps[input["id"]] = input["step"];
  for (const Json& input : Json::parse(run_soda({"log", log, "--json", "--lines", "inputs"}).out))
    logged[input["id"]] = input["step"];
  EXPECT_TRUE(steps.contains(50) && steps.contains(51)) << run.out;
  EXPECT_EQ(logged, steps);
  for (const char* worlds : {"1", "12"}) {
    const ChildResult replay = run_soda({"replay", log, "--worlds", worlds, "--json"});
    EXPECT_EQ(replay.exit_code, 0) << replay.err;
    EXPECT_EQ(digest_in(replay.out), digest_in(run.out));
  }
}

TEST(UserInputCommand, AllFaultsOfAFileOfInputsAreListedWithTheirLines) {
  const TemporaryFolder folder;
  const std::string lines = folder.file("lines.jsonl");
  write_file(lines,
             "{\"id\": 50, \"type\": \"push\", \"body\": 3}\n"
             "{\"id\": 51, \"type\": \"remove\", \"body\": 99}\n"
             "{\"id\": 3, \"type\": \"remove\", \"body\": 3}\n"
             "{\"id\": 52, \"type\": \"remov\", \"body\": 3}\n"
             "{\"id\": 53, \"type\": \"remove\", \"body\": 3, \"step\": 1, \"time_s\": 1}\n"
             "nonsense\n");
  const ChildResult found = run_soda({"run", scene(), "--inputs", lines});
  EXPECT_EQ(found.exit_code, 2);
  for (const char* part : {":1:", "impulse_newton_s", ":2:", "/body: found 99, which no body has",
                           ":3:", "ids that no other input has", ":4:", "did you mean \"remove\"?",
                           ":5:", "a step and a time", ":6:"})
    EXPECT_TRUE(contains(found.err, part)) << part << " in\n" << found.err;
}

TEST(UserInputCommand, FaultsOfTheScenarioSayWhatIsAllowed) {
  const TemporaryFolder folder;
  Json scenario = Json::parse(read_file(scene()));
  scenario["inputs"] = Json::parse(R"([
    {"id": 1, "type": "push", "body": 0, "impulse_newton_s": [1, 0, 0]},
    {"id": 2, "type": "set-velocity", "body": 0, "step": 3}])");
  write_file(folder.file("scene.json"), scenario.dump(1));
  const ChildResult untimed = run_soda({"run", folder.file("scene.json")});
  EXPECT_EQ(untimed.exit_code, 2);
  EXPECT_TRUE(contains(untimed.err, "/inputs/0")) << untimed.err;
  scenario["inputs"][0]["time_s"] = 0.01;
  write_file(folder.file("scene.json"), scenario.dump(1));
  const ChildResult found = run_soda({"run", folder.file("scene.json")});
  EXPECT_EQ(found.exit_code, 2);
  EXPECT_TRUE(contains(found.err, "/inputs/0/time_s")) << found.err;
  EXPECT_TRUE(contains(found.err, "a whole number of steps")) << found.err;
  EXPECT_TRUE(contains(found.err, "/inputs/1: found neither velocity_m_s")) << found.err;
}

}  // namespace
}  // namespace soda::analysis
