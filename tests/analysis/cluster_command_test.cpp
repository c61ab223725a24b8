// The virtual cluster from the command line: `soda run`, `soda phold` and `soda swarm`.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::library_file;
using analysis_test::run_soda;
using Json = nlohmann::json;

Json json_of(const std::vector<std::string>& arguments) {
  const ChildResult result = run_soda(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return Json::parse(result.out);
}

TEST(ClusterCommands, RunReportsEveryDocumentedKeyAndTheDigestOfEveryExecutor) {
  const std::vector<std::string> run = {
      "run", library_file("border-stack"), "--steps", "20", "--worlds", "4", "--json"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), run.begin(), run.end());
    return json_of(more);
  };
  const Json oracle = with({"--executor", "sequential"});
  EXPECT_FALSE(oracle.contains("virtual"));
  for (const char* policy : {"optimistic", "lockstep"}) {
    const Json json = with(
        {"--executor", "virtual", "--processors", "3", "--latency-us", "20", "--policy", policy});
    EXPECT_EQ(json["digest"], oracle["digest"]);
    EXPECT_EQ(json["policy"], policy);
    const Json& cluster = json["virtual"];
    for (const char* key :
         {"processors", "makespan_s", "one_processor_s", "speed_up", "utilisation", "messages",
          "bytes", "barriers", "most_history", "execution_digest"})
      EXPECT_TRUE(cluster.contains(key)) << key;
    EXPECT_EQ(cluster["processors"], 3);
    EXPECT_EQ(cluster["barriers"] == 0, std::string(policy) == "optimistic");
  }
}

// Latencies of about a tenth of a step.
TEST(ClusterCommands,
     WithDependencyWaitsStacksAndChainsOnBordersAreSolvedAtMostFifteenPercentTooOften) {
  const auto rework = [](const char* scene, const char* steps, const char* latency_us,
                         const char* gating) {
    const Json islands =
        json_of({"run", library_file(scene), "--executor", "virtual", "--steps", steps,
                 "--latency-us", latency_us, "--gating", gating, "--json"})["islands"];
    return (islands["solved"].get<double>() + islands["at_rest"].get<double>() +
            islands["reused"].get<double>()) /
           islands["solves_committed"].get<double>();
  };
  EXPECT_LE(rework("border-stack", "300", "30", "on"), 1.15);
  EXPECT_GT(rework("border-stack", "300", "30", "off"), 1.4);
  EXPECT_LE(rework("five-worlds-chain", "60", "15", "on"), 1.15);
  EXPECT_GT(rework("five-worlds-chain", "60", "15", "off"), 2.0);
}

TEST(ClusterCommands, PholdGivesOneDigestUnderEveryExecutorAndPolicy) {
  const auto phold = [](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"phold", "--lps",    "32",  "--lookahead",
                                          "0",     "--remote", "0.6", "--zero-delay-rounds",
                                          "1",     "--end",    "40",  "--order-sensitive",
                                          "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ChildResult result = run_soda(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out);
  };
  const Json oracle = phold({});
  EXPECT_GT(oracle["committed_events"], 1000);
  EXPECT_FALSE(oracle.contains("virtual"));
  const std::vector<std::string> threads = {"--executor", "threads", "--threads", "2"};
  const std::vector<std::string> cluster = {"--executor",   "virtual", "--processors", "5",
                                            "--latency-us", "3",       "--cost-us",    "2"};
  for (const std::vector<std::string>& executor : {threads, cluster}) {
    for (const char* policy : {"optimistic", "lockstep"}) {
      std::vector<std::string> arguments = executor;
      arguments.insert(arguments.end(), {"--policy", policy, "--window", "3"});
      const Json json = phold(arguments);
      EXPECT_EQ(json["digest"], oracle["digest"]) << executor[1] << ' ' << policy;
      EXPECT_EQ(json["committed_events"], oracle["committed_events"]);
      EXPECT_EQ(json["executor"], executor[1]);
      EXPECT_EQ(json["policy"], policy);
      if (std::string(policy) == "lockstep") {
        EXPECT_EQ(json["events"]["rollbacks"], 0);
      }
    }
  }
}

TEST(ClusterCommands, PholdOnTheVirtualClusterRepeatsItselfAndItsClockFollowsItsOptions) {
  const auto cluster = [](const char* processors, const char* latency_us, const char* cost_us) {
    const ChildResult result = run_soda(
        {"phold", "--lps", "24", "--end", "40", "--window", "3", "--executor", "virtual",
         "--processors", processors, "--latency-us", latency_us, "--cost-us", cost_us, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out)["virtual"];
  };
  const Json once = cluster("4", "5", "2");
  EXPECT_EQ(once, cluster("4", "5", "2"));
  EXPECT_EQ(once["processors"], 4);
  EXPECT_GT(cluster("4", "50", "2")["makespan_s"], once["makespan_s"]);
  EXPECT_EQ(cluster("1", "5", "2")["messages"], 0);
  EXPECT_DOUBLE_EQ(cluster("4", "5", "4")["one_processor_s"].get<double>(),
                   2.0 * once["one_processor_s"].get<double>());
}

TEST(ClusterCommands, SwarmReportsItsSums) {
  const Json json = json_of({"swarm", "--seeds", "3..12", "--json"});
  EXPECT_EQ(json["trials"], 10);
  EXPECT_EQ(json["failed"], false);
  for (const char* key : {"out_of_time", "wall_s", "executed", "rolled_back", "committed",
                          "rollbacks", "anti_messages"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_GT(json["committed"], 0);
}

TEST(CompareCommand, OnlyWarmRollbacksStrayFromTheExactTrajectory) {
  const Json json = json_of(
      {"compare", library_file("eight-corner"), "--steps", "60", "--latency-us", "100", "--json"});
  const std::map<std::string, std::vector<std::string>> settings = {
      {"rollback", {"propagate", "invalidate", "warm"}},
      {"gating", {"on", "off"}},
      {"ghosts", {"told", "dead-reckoning", "predicted"}},
      {"balancing", {"off", "paper"}},
      {"islands", {"on", "off"}}};
  ASSERT_EQ(json["aspects"].size(), settings.size());
  for (const auto& [aspect, names] : settings) {
    const Json& found = json["aspects"][aspect];
    ASSERT_EQ(found.size(), names.size()) << aspect;
    for (std::size_t i = 0; i < names.size(); ++i) {
      EXPECT_EQ(found[i]["setting"], names[i]);
      const bool exact = names[i] != "warm";
      EXPECT_GT(found[i]["makespan_s"], 0.0) << found[i];
      EXPECT_EQ(found[i]["first_different_step"].is_null(), exact) << found[i];
      EXPECT_EQ(found[i]["position_deviation_m"] == 0.0, exact) << found[i];
      EXPECT_EQ(found[i]["islands_warm"] == 0, exact) << found[i];
    }
  }
  EXPECT_GT(json["aspects"]["rollback"][0]["rollbacks"], 0);
  EXPECT_GT(json["aspects"]["ghosts"][2]["ghosts_guessed"], 0);
}

TEST(CompareCommand, TellsOnlyWhatIsAskedForAndLeavesOutWhatIsZero) {
  const std::vector<std::string> asked = {
      "compare", library_file("border-stack"), "--steps", "5", "--over", "rollback"};
  const ChildResult text = run_soda(asked);
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_TRUE(analysis_test::contains(text.out, "invalidate")) << text.out;
  EXPECT_FALSE(analysis_test::contains(text.out, "balancing")) << text.out;
  EXPECT_FALSE(analysis_test::contains(text.out, "cells moved")) << text.out;
  std::vector<std::string> csv = asked;
  csv.push_back("--csv");
  const std::string lines = run_soda(csv).out;
  EXPECT_EQ(std::ranges::count(lines, '\n'), 4) << lines;
  EXPECT_TRUE(lines.starts_with("aspect,setting,rollbacks,steps_repeated,")) << lines;
  EXPECT_EQ(run_soda({"compare", library_file("border-stack"), "--over", "gatling"}).exit_code, 2);
}

TEST(RollbackCommand, WarmHasNoLogAndNoPurityCheck) {
  const std::vector<std::string> run = {"run", library_file("border-stack"), "--rollback", "warm"};
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--log", "never-written.sodalog"}, {"--check-purity"}}) {
    std::vector<std::string> arguments = run;
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ChildResult result = run_soda(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(analysis_test::contains(result.err, "warm")) << result.err;
  }
}

}  // namespace
}  // namespace soda::analysis
