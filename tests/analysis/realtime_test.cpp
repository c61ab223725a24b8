// `soda run --realtime` through the binary. How long frames take is up to the machine, so only what
// is not is tested here; the rest is tested on a virtual clock (tests/models).
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::library_file;
using analysis_test::run_soda;
using Json = nlohmann::json;

Json run_json_of(std::vector<std::string> more) {
  std::vector<std::string> arguments = {
      "run", library_file("border-stack"), "--steps", "30", "--quiet", "--json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const ChildResult result = run_soda(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return Json::parse(result.out);
}

TEST(RealTimeCommand, ShowsEveryStepInOrderAndComputesTheSameBits) {
  const Json plain = run_json_of({"--executor", "sequential"});
  for (const std::vector<std::string>& executor :
       {std::vector<std::string>{"--executor", "sequential", "--worlds", "1"},
        std::vector<std::string>{"--threads", "2", "--worlds", "4"},
        std::vector<std::string>{"--threads", "2", "--worlds", "4", "--policy", "lockstep"},
        std::vector<std::string>{"--executor", "virtual", "--worlds", "3"}}) {
    std::vector<std::string> arguments = executor;
    for (const char* more : {"--realtime", "--fps", "120", "--speed", "2", "--load", "0.1"})
      arguments.emplace_back(more);
    const Json json = run_json_of(arguments);
    EXPECT_EQ(json["digest"], plain["digest"]);
    const Json& shown = json["real_time"];
    EXPECT_EQ(shown["frames"], shown["clock"].size());
    EXPECT_EQ(shown["frames"], shown["fill"].size());
    EXPECT_EQ(shown["frames"].get<int>(),
              shown["on_time"].get<int>() + shown["slow"].get<int>() + shown["late"].get<int>());
    EXPECT_EQ(shown["clock"].front(), 0);
    EXPECT_EQ(shown["clock"].back(), 30);
    for (std::size_t i = 1; i < shown["clock"].size(); ++i) {
      const int advance = shown["clock"][i].get<int>() - shown["clock"][i - 1].get<int>();
      EXPECT_EQ(advance, shown["fate"][i] == "late" ? 0 : 1) << i;
    }
  }
  EXPECT_FALSE(plain.contains("real_time"));
}

TEST(RealTimeCommand, WhatNoWallClockCanPaceIsAUsageError) {
  const std::string scene = library_file("border-stack");
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"run", scene, "--fps", "30"}, "--fps"},
      {{"run", scene, "--realtime", "--fps", "0"}, "--fps"},
      {{"run", scene, "--realtime", "--speed", "-1"}, "--speed"},
      {{"run", scene, "--realtime", "--executor", "virtual", "--policy", "lockstep"}, "lockstep"},
  };
  for (const auto& [arguments, expected] : cases) {
    const ChildResult result = run_soda(arguments);
    EXPECT_EQ(result.exit_code, 2) << expected;
    EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
    EXPECT_EQ(result.out, "") << expected;
  }
}

// Frames by the virtual clock: the same on every machine.
TEST(RealTimeCommand, OnTheVirtualClusterARunIsShownTheSameTwice) {
  const std::vector<std::string> arguments = {
      "--executor", "virtual",     "--worlds", "4",          "--buffer",
      "6",          "--realtime",  "--load",   "0.8",        "--peak",
      "4",          "--peak-from", "0.1",      "--peak-for", "0.2"};
  const Json first = run_json_of(arguments), second = run_json_of(arguments);
  EXPECT_EQ(first["real_time"]["fill"], second["real_time"]["fill"]);
  EXPECT_EQ(first["real_time"]["fate"], second["real_time"]["fate"]);
  EXPECT_EQ(first["virtual"]["execution_digest"], second["virtual"]["execution_digest"]);
  EXPECT_GT(first["real_time"]["late"], 0)
      << "steps of four frames for .2 s: more than six entries can hide";
}

TEST(RealTimeCommand, TakesUserInputFromAStreamAndLogsItWithItsFinalSteps) {
  const analysis_test::TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog");
  const std::string program = SODA_BINARY_DIR "/soda";
  const ChildResult result = analysis_test::run_child(
      {"/bin/sh", "-c",
       R"((sleep 0.2;)"
       R"( echo '{"id": 1, "type": "push", "body": 0, "impulse_newton_s": [0, 0, 3000]}';)"
       R"( sleep 0.2; echo '{"id": 2, "type": "remove", "body": 1}') | )" +
           program + " run " + library_file("eight-corner") +
           " --threads 2 --worlds 4 --steps 60 --realtime --inputs - --quiet --json --log " + log});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  ASSERT_EQ(json["inputs"].size(), 2u);
  for (const Json& input : json["inputs"]) {
    EXPECT_EQ(input["had_effect"], true);
    EXPECT_GT(input["step"], 0) << "it came while the run went on";
  }
  const ChildResult replay = run_soda({"replay", log, "--executor", "sequential", "--worlds", "1"});
  EXPECT_EQ(replay.exit_code, 0) << replay.out;
}

}  // namespace
}  // namespace soda::analysis
