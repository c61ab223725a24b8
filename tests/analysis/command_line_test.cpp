// `soda` as its users meet it: through the binary.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/event_log/log_writer.hpp"
#include "analysis/forged_log.hpp"
#include "analysis/text/text_table.hpp"

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

// The library scene that these tests run: small, with rollbacks when divided.
ChildResult run_scene(std::vector<std::string> more) {
  std::vector<std::string> arguments = {"run", library_file("border-stack"), "--steps", "20"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_soda(arguments);
}

TEST(CommandLine, HelpAndVersionSucceed) {
  EXPECT_EQ(run_soda({"--version"}).out, "soda 0.1.0\n");
  for (const char* command : {"run", "plan", "replay", "verify", "accuracy", "anticipation",
                              "phold", "swarm", "fuzz", "schema"}) {
    const ChildResult help = run_soda({command, "--help"});
    EXPECT_EQ(help.exit_code, 0) << command;
    EXPECT_TRUE(contains(help.out, "example")) << command;
    EXPECT_TRUE(contains(run_soda({"--help"}).out, command)) << command;
  }
}

TEST(CommandLine, UsageErrorsExitWith2AndNameTheNearest) {
  const std::string scene = library_file("border-stack");
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{}, "--help"},
      {{"rnu", scene}, "did you mean run?"},
      {{"run", scene, "--thread", "2"}, "did you mean --threads?"},
      {{"run", scene, "--jsno"}, "did you mean --json?"},
      {{"run", scene, "--frobnicate"}, "unknown argument --frobnicate"},
      {{"run"}, "FILE"},
      {{"run", scene, "--executor", "magic"}, "--executor"},
      {{"run", scene, "--threads", "0"}, "--threads"},
      {{"run", scene, "--threads", "two"}, "--threads"},
      {{"run", scene, "--worlds", "0"}, "--worlds"},
      {{"run", scene, "--worlds", "99999999"}, "--worlds"},
      {{"run", scene, "--buffer", "0"}, "--buffer"},
      {{"run", scene, "--steps", "-1"}, "--steps"},
      {{"run", scene, "--executor", "sequential", "--threads", "2"}, "--threads"},
      {{"replay", "a.sodalog", "--body", "1"}, "--step"},
      {{"run", scene, "--buffer", "9223372036854775807"}, "at most 1000000"},
      {{"run", scene, "--steps", "9223372036854775807"}, "at most 1000000000"},
      {{"run", scene, "--balancing", "paper", "--balancing-interval", "9223372036854775807"},
       "--balancing-interval"},
      {{"run", scene, "--realtime", "--fps", "nan"}, "--fps"},
      {{"run", scene, "--realtime", "--speed", "nan"}, "--speed"},
      {{"run", scene, "--realtime", "--load", "nan"}, "--load"},
      {{"phold", "--remote", "nan"}, "--remote: found nan"},
      {{"phold", "--lookahead", "nan"}, "found nan"},
      {{"fuzz", "--budget", "nan"}, "--budget"},
      {{"swarm", "--budget", "nan"}, "--budget"},
      {{"accuracy", "--budget", "nan"}, "--budget"},
      {{"phold", "--executor", "magic"}, "--executor"},
      {{"phold", "--end", "0"}, "--end"},
      {{"phold", "--policy", "lockstep"}, "--policy"},
      {{"phold", "--processors", "2"}, "--executor virtual"},
      {{"phold", "--executor", "threads", "--latency-us", "5"}, "--executor virtual"},
      {{"phold", "--executor", "virtual", "--processors", "0"}, "--processors"},
      {{"phold", "--executor", "virtual", "--cost-us", "-1"}, "--cost-us"},
      {{"anticipation", "--buffers", "0"}, "--buffers"},
      {{"anticipation", "--overloads", "-1"}, "--overloads"},
      {{"anticipation", "--utilisation", "0"}, "--utilisation"},
  };
  for (const auto& [arguments, part] : cases) {
    const ChildResult result = run_soda(arguments);
    EXPECT_EQ(result.exit_code, 2) << part;
    EXPECT_EQ(result.out, "") << part;
    EXPECT_TRUE(contains(result.err, part)) << part << " in:\n" << result.err;
  }
}

TEST(CommandLine, BrokenScenariosExitWith2AndWriteNothing) {
  const TemporaryFolder folder;
  const std::string file = folder.file("broken.json");
  const std::string log = folder.file("run.sodalog");
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string("{\"unknown_key\": 1}"),
        std::string("\0\xff\xfe", 3), std::string(200000, '['),
        read_file(library_file("border-stack")).substr(0, 100)}) {
    write_file(file, text);
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"run", file, "--json", "--log", log}, {"plan", file}}) {
      const ChildResult result = run_soda(arguments);
      EXPECT_EQ(result.exit_code, 2) << text.substr(0, 50);
      EXPECT_EQ(result.out, "");
      EXPECT_TRUE(contains(result.err, "broken.json:")) << result.err.substr(0, 200);
    }
    EXPECT_FALSE(std::filesystem::exists(log));
  }
}

TEST(CommandLine, WhatCannotBeReadOrWrittenExitsWith3) {
  const TemporaryFolder folder;
  EXPECT_EQ(run_soda({"run", folder.file("missing.json")}).exit_code, 3);
  EXPECT_EQ(run_soda({"run", folder.file("")}).exit_code, 3);
  EXPECT_EQ(run_soda({"run", folder.file(""), "--log", folder.file("a")}).exit_code, 3);
  EXPECT_EQ(run_soda({"replay", folder.file("missing.sodalog")}).exit_code, 3);
  EXPECT_EQ(run_soda({"replay", library_file("border-stack")}).exit_code, 3);
  EXPECT_EQ(run_scene({"--log", "/nonexistent-folder/run.sodalog"}).exit_code, 3);
}

// As the tutorial has it: the build tree is on the PATH, and the user somewhere else.
TEST(CommandLine, InTheBuildTreeItFindsScenesAndCasesFromAnyFolder) {
  const TemporaryFolder folder;
  const auto run_there = [&folder](const std::string& arguments) {
    return analysis_test::run_child(
        {"/bin/sh", "-c",
         "cd '" + folder.file(".") + "' && '" SODA_BINARY_DIR "/soda' " + arguments});
  };
  EXPECT_EQ(run_there("accuracy free-fall --repeat 0").exit_code, 0);
  EXPECT_EQ(run_there("run scenarios/library/pyramid.json --steps 1 --quiet").exit_code, 0);
  EXPECT_EQ(run_there("run scenarios/library/none.json --steps 1").exit_code, 3);
  // A file of that name in the folder itself comes first.
  std::filesystem::create_directories(folder.file("scenarios/library"));
  write_file(folder.file("scenarios/library/pyramid.json"), "{}");
  EXPECT_EQ(run_there("run scenarios/library/pyramid.json --steps 1").exit_code, 2);
}

TEST(CommandLine, JsonHasEveryDocumentedKey) {
  const ChildResult result = run_scene({"--worlds", "2", "--threads", "2", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  for (const char* key : {"/scenario",
                          "/digest",
                          "/steps",
                          "/bodies",
                          "/worlds",
                          "/executor",
                          "/threads",
                          "/ranks",
                          "/buffer",
                          "/wall_s",
                          "/cpu_s",
                          "/events/executed",
                          "/events/rolled_back",
                          "/events/committed",
                          "/events/stragglers",
                          "/events/anti_messages",
                          "/events/efficiency",
                          "/events/history_max",
                          "/islands/committed",
                          "/islands/solved",
                          "/islands/reused",
                          "/lead/mean_steps",
                          "/lead/max_steps",
                          "/error/energy_drift_rel",
                          "/error/momentum_drift_rel",
                          "/error/max_penetration_m",
                          "/error/constraint_residual",
                          "/error/push_out_work_joule",
                          "/stages/boxes",
                          "/stages/islands_solved",
                          "/stages/ghosts_sent",
                          "/plan/0/stage",
                          "/plan/0/counted"}) {
    EXPECT_TRUE(json.contains(Json::json_pointer(key))) << key;
  }
  EXPECT_EQ(json["scenario"], "border-stack");
  EXPECT_EQ(json["steps"], 20);
  EXPECT_EQ(json["worlds"], 2);
  EXPECT_EQ(json["executor"], "threads");
  EXPECT_EQ(json["threads"], 2);
  EXPECT_EQ(json["ranks"], 1);
  EXPECT_EQ(json["digest"].get<std::string>().size(), 16u);
  EXPECT_FALSE(json.contains("step_digests"));
  EXPECT_EQ(json["events"]["committed"].get<std::int64_t>(),
            json["events"]["executed"].get<std::int64_t>() -
                json["events"]["rolled_back"].get<std::int64_t>());
}

TEST(CommandLine, EveryDivisionReportsTheSameTrajectoryAndErrors) {
  const ChildResult one =
      run_scene({"--executor", "sequential", "--worlds", "1", "--json", "--step-digests"});
  const ChildResult two =
      run_scene({"--worlds", "2", "--threads", "2", "--json", "--step-digests"});
  ASSERT_EQ(one.exit_code, 0) << one.err;
  ASSERT_EQ(two.exit_code, 0) << two.err;
  const Json a = Json::parse(one.out), b = Json::parse(two.out);
  ASSERT_EQ(a["step_digests"].size(), 20u);
  EXPECT_EQ(a["step_digests"], b["step_digests"]);
  EXPECT_EQ(a["step_digests"].back(), a["digest"]);
  EXPECT_EQ(a["error"], b["error"]);
  EXPECT_EQ(a["islands"]["committed"], b["islands"]["committed"]);
  EXPECT_LT(a["error"]["momentum_drift_rel"].get<double>(), 1e-12);
}

// Friction, restitution, statics, all shapes: what the bodies gained is what gravity and the
// reported impulses of statics gave.
TEST(CommandLine, MomentumIsConservedUpToRounding) {
  for (const char* scene :
       {"bin-1000", "mixed-shapes", "pyramid", "big-body", "factory-line", "crowd"}) {
    const ChildResult result = run_soda({"run", library_file(scene), "--executor", "sequential",
                                         "--worlds", "1", "--steps", "60", "--json"});
    ASSERT_EQ(result.exit_code, 0) << scene << ": " << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_LT(json["error"]["momentum_drift_rel"].get<double>(), 1e-12) << scene;
  }
}

TEST(CommandLine, TheReportShowsErrorBesideRunTime) {
  const ChildResult result = run_scene({"--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  for (const char* part :
       {"energy drift", "momentum drift", "deepest penetration", "constraint residual", "wall time",
        "CPU time", "steps/s", "real-time factor", "efficiency", "digest"}) {
    EXPECT_TRUE(contains(result.out, part)) << part;
  }
}

TEST(CommandLine, WhatThePlanLeavesOutCountsNothing) {
  for (const char* scene : {"border-stack", "spheres-frictionless", "detection-only"}) {
    for (const char* worlds : {"1", "2"}) {
      const ChildResult result =
          run_soda({"run", library_file(scene), "--steps", "20", "--worlds", worlds, "--json"});
      ASSERT_EQ(result.exit_code, 0) << scene << ": " << result.err;
      std::size_t left_out = 0;
      const Json json = Json::parse(result.out);
      for (const Json& line : json["plan"]) {
        if (line["needed"].get<bool>()) continue;
        ++left_out;
        EXPECT_EQ(line["counted"], 0) << scene << ": " << line["stage"];
      }
      EXPECT_GT(left_out, 0u) << scene;
    }
  }
}

TEST(CommandLine, ThePlanSaysWhyGhostsAreNeeded) {
  const auto needed = [](const char* worlds) {
    const ChildResult result =
        run_soda({"plan", library_file("border-stack"), "--worlds", worlds, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::size_t count = 0;
    const Json json = Json::parse(result.out);
    for (const Json& line : json["plan"]) {
      EXPECT_NE(line["reason"], "");
      count += line["needed"].get<bool>() ? 1 : 0;
    }
    return count;
  };
  EXPECT_LT(needed("1"), needed("2"));
}

TEST(CommandLine, TheSchemaIsJson) {
  const ChildResult result = run_soda({"schema"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(Json::parse(result.out).contains("$schema"));
}

TEST(CommandLine, TheSchemaAsAPageHasARowForEachKey) {
  const ChildResult result = run_soda({"schema", "--markdown"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(result.out.starts_with("# "));
  EXPECT_NE(result.out.find("\n| `friction` | number |  | 0 to 100 | required |"), result.out.npos);
}

class Replay : public testing::Test {
 protected:
  void SetUp() override {
    const ChildResult result = run_scene({"--worlds", "2", "--threads", "2", "--log", log_});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  // The file offset of the block of `step`.
  std::size_t step_block(const std::string& bytes, std::int64_t step) const {
    std::size_t at = kFileHeaderBytes;
    for (std::int64_t block = 0; block < 3 + step; ++block) {
      at += kBlockHeaderBytes + header_at(bytes, at).stored_bytes;
    }
    return at;
  }
  static BlockHeader header_at(const std::string& bytes, std::size_t at) {
    const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
    return decode_block_header({data + at, kBlockHeaderBytes});
  }

  // The log with one step changed.
  void rewrite(std::int64_t changed_step, const std::function<void(LoggedStep&)>& change) const {
    analysis_test::rewrite_log(log_, folder_.file("altered.sodalog"), [&](LoggedStep& step) {
      if (step.step == changed_step) change(step);
    });
  }

  TemporaryFolder folder_;
  std::string log_ = folder_.file("run.sodalog");
};

TEST_F(Replay, RunsWithoutDivergenceHoweverItIsExecuted) {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{},
        {"--executor", "sequential"},
        {"--worlds", "1"},
        {"--threads", "2", "--worlds", "4", "--buffer", "1", "--scheduling-seed", "7"}}) {
    std::vector<std::string> arguments = {"replay", log_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ChildResult result = run_soda(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(contains(result.out, "20 steps replayed without divergence")) << result.out;
  }
}

TEST_F(Replay, AFlippedBitIsFoundInItsStep) {
  std::string bytes = read_file(log_);
  bytes[step_block(bytes, 13) + kBlockHeaderBytes + 20] ^= 1;
  write_file(log_, bytes);
  const ChildResult result = run_soda({"replay", log_});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(contains(result.err, "(step 13)")) << result.err;
}

TEST_F(Replay, AFlippedDigestBitWithSoundChecksumsIsFoundInItsStep) {
  rewrite(13, [](LoggedStep& step) { step.digest ^= 1u << 9; });
  const ChildResult result = run_soda({"replay", folder_.file("altered.sodalog")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(contains(result.err, "divergence at step 13: ")) << result.err;
  EXPECT_TRUE(contains(result.err, "the digest in the log was altered")) << result.err;
}

TEST_F(Replay, AChangedStateIsNamedByStepBodyFieldAndBothValues) {
  const std::uint32_t label = LogReader(log_).labels().back();
  rewrite(13, [](LoggedStep& step) { step.states.back().position_m.y() = 0.125; });
  const ChildResult result = run_soda({"replay", folder_.file("altered.sodalog"), "--worlds", "1"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(contains(result.err, "divergence at step 13: body " + std::to_string(label) + ","))
      << result.err;
  EXPECT_TRUE(contains(result.err, "position_m.y: logged 0.125 (0x3fc0000000000000), replayed "))
      << result.err;
}

TEST_F(Replay, ALogCutOffIsReplayedUpToItsLastWholeStepAndSaysSo) {
  const std::string bytes = read_file(log_);
  for (const std::size_t length :
       {step_block(bytes, 13), step_block(bytes, 13) + 7, step_block(bytes, 14) - 1}) {
    write_file(log_, bytes.substr(0, length));
    const ChildResult result = run_soda({"replay", log_});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(contains(result.err, "cut off")) << result.err;
    EXPECT_TRUE(contains(result.err, "read up to step 12")) << result.err;
    EXPECT_TRUE(contains(result.out, "12 steps replayed")) << result.out;
  }
  write_file(log_, bytes.substr(0, 50));
  EXPECT_EQ(run_soda({"replay", log_}).exit_code, 3);
}

TEST_F(Replay, ShowsAStateWithoutRunning) {
  const ChildResult all = run_soda({"replay", log_, "--step", "20"});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  const Json run = Json::parse(run_scene({"--json"}).out);
  EXPECT_TRUE(contains(all.out, run["digest"].get<std::string>())) << all.out;
  const std::string label = std::to_string(LogReader(log_).labels().back());
  const ChildResult one = run_soda({"replay", log_, "--step", "20", "--body", label});
  EXPECT_EQ(one.exit_code, 0) << one.err;
  const double x_m = LogReader(log_).read_step(20).states.back().position_m.x();
  EXPECT_TRUE(contains(one.out, format_bits(x_m))) << one.out;
  EXPECT_EQ(run_soda({"replay", log_, "--step", "21"}).exit_code, 2);
  EXPECT_EQ(run_soda({"replay", log_, "--step", "5", "--body", "4000000"}).exit_code, 2);
}

TEST_F(Replay, TheScenarioFileIsNotNeededAnyMore) {
  const std::string copy = folder_.file("copy.json");
  write_file(copy, read_file(library_file("border-stack")));
  ASSERT_EQ(run_soda({"run", copy, "--steps", "5", "--log", log_, "--force"}).exit_code, 0);
  std::filesystem::remove(copy);
  EXPECT_EQ(run_soda({"replay", log_}).exit_code, 0);
}

}  // namespace
}  // namespace soda::analysis
