// `soda branch`: another future from a step, through the binary.
#include <gtest/gtest.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;
using nlohmann::json;
using Options = std::vector<std::string>;

class Branch : public testing::Test {
 protected:
  void record(const std::string& scene, int steps, const Options& more = {}) {
    Options command = {"run", library_file(scene), "--steps", std::to_string(steps), "--log",
                       log_,  "--force",           "--quiet"};
    command.insert(command.end(), more.begin(), more.end());
    const ChildResult result = run_soda(command);
    ASSERT_EQ(result.exit_code, kExitOk) << result.err;
  }
  ChildResult branched(int step, const Options& more = {}) const {
    Options command = {"branch", log_, "--step", std::to_string(step), "--inputs", inputs_};
    command.insert(command.end(), more.begin(), more.end());
    return run_soda(command);
  }

  // As of a branch of which all was computed, with these inputs.
  void expect_the_same_of_the_cone(int from, const json& all, const std::string& scene) const {
    const ChildResult result = branched(from, {"--json"});
    ASSERT_EQ(result.exit_code, kExitOk) << scene << ": " << result.err;
    const json few = json::parse(result.out);
    for (const char* key : {"first_step", "steps", "inputs", "digest", "differences"})
      EXPECT_EQ(few[key], all[key]) << scene << " " << key;
    std::cout << scene << ": " << few["body_steps"] << " of " << all["body_steps"]
              << " bodies and steps\n";
  }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.file("run.sodalog"), branch_ = folder_.file("branch.sodalog"),
                    inputs_ = folder_.file("inputs.jsonl");
};

std::string push(int id, int step, int body) {
  return R"({"id": )" + std::to_string(id) + R"(, "type": "push", "step": )" +
         std::to_string(step) + R"(, "body": )" + std::to_string(body) +
         R"(, "impulse_newton_s": [40, 15, 60]})" + "\n";
}

TEST_F(Branch, EveryStepIsThatOfTheWholeRunWithTheInputs) {
  const struct {
    const char* name;
    int steps, from, body;
  } scenes[] = {
      {"user-input", 70, 9, 4},       {"border-stack", 100, 40, 1}, {"crowd", 60, 23, 7},
      {"breaking-bridge", 80, 41, 3}, {"rope-bridge", 50, 20, 2},   {"ragdolls", 40, 15, 5},
      {"mixed-shapes", 60, 30, 2},    {"billiards", 60, 10, 3},     {"mill", 60, 30, 20}};
  const Options ways[] = {{}, {"--threads", "2", "--worlds", "4"}, {"--executor", "virtual"}};
  std::size_t way = 0;
  for (const auto& scene : scenes) {
    const LogReader recorded = [&] {
      record(scene.name, scene.steps, ways[way++ % 3]);
      return LogReader(log_);
    }();
    const auto body = static_cast<int>(
        recorded.labels()[static_cast<std::size_t>(scene.body) % recorded.labels().size()]);
    write_file(inputs_, push(9001, scene.from, body) + push(9002, scene.from + 7, body));
    const ChildResult whole =
        run_soda({"run", library_file(scene.name), "--steps", std::to_string(scene.steps),
                  "--inputs", inputs_, "--json", "--step-digests", "--quiet"});
    ASSERT_EQ(whole.exit_code, kExitOk) << scene.name << ": " << whole.err;
    const ChildResult branch = branched(scene.from, {"--log", branch_, "--force", "--json"});
    ASSERT_EQ(branch.exit_code, kExitOk) << scene.name << ": " << branch.err;
    const json digests = json::parse(whole.out)["step_digests"];
    LogReader log(branch_);
    EXPECT_EQ(log.first_step(), scene.from);
    ASSERT_EQ(log.last_step(), scene.steps);
    for (std::int64_t step = scene.from + 1; step <= scene.steps; ++step) {
      char text[17];
      std::snprintf(text, sizeof text, "%016lx", log.read_step(step).digest);
      ASSERT_EQ(digests[static_cast<std::size_t>(step) - 1], text) << scene.name << " " << step;
    }
    const json all = json::parse(branch.out);
    EXPECT_EQ(all["digest"], digests.back()) << scene.name;
    expect_the_same_of_the_cone(scene.from, all, scene.name);
  }
}

// What lasts, what comes and goes, at several steps, some of it in the recorded run already.
TEST_F(Branch, WhatDiffersAloneIsTheSameForEveryKindOfInput) {
  record("user-input", 70);
  write_file(inputs_, push(9001, 9, 4) +
                          R"({"id": 9002, "type": "remove", "step": 15, "body": 20})" + "\n" +
                          R"({"id": 9003, "type": "change-material", "step": 20, "body": 3, )" +
                          R"("friction": 0.01, "restitution": 0.9})" + "\n" + push(9004, 40, 20) +
                          R"({"id": 9005, "type": "set-velocity", "step": 41, "body": 22, )" +
                          R"("velocity_m_s": [0, 9, 5]})" + "\n");
  const ChildResult all = branched(9, {"--log", branch_, "--json"});
  ASSERT_EQ(all.exit_code, kExitOk) << all.err;
  expect_the_same_of_the_cone(9, json::parse(all.out), "user-input");

  record("robot-arm", 90);
  write_file(inputs_, R"({"id": 9001, "type": "set-motor", "step": 60, "joint": 2, )"
                      R"("motor_target_rad": 0.4})"
                      "\n");
  const ChildResult arm = branched(30, {"--log", branch_, "--force", "--json"});
  ASSERT_EQ(arm.exit_code, kExitOk) << arm.err;
  expect_the_same_of_the_cone(30, json::parse(arm.out), "robot-arm");
}

// One body of many is pushed: few are computed. Beyond the recorded steps, all are.
TEST_F(Branch, WhatIsFarFromThePushIsTakenFromTheLog) {
  record("crowd", 60);
  write_file(inputs_, push(9001, 23, static_cast<int>(LogReader(log_).labels()[3])));
  const json all = json::parse(branched(23, {"--log", branch_, "--json"}).out);
  const json few = json::parse(branched(23, {"--json"}).out);
  EXPECT_EQ(few["digest"], all["digest"]);
  EXPECT_EQ(few["differences"], all["differences"]);
  EXPECT_LT(few["body_steps"].get<int>(), all["body_steps"].get<int>() / 5);
  const json part = json::parse(branched(23, {"--json", "--steps", "40"}).out);
  EXPECT_EQ(part["differences"].back(), all["differences"][16]);
  EXPECT_LT(part["body_steps"].get<int>(), few["body_steps"].get<int>());
  const json more = json::parse(branched(23, {"--json", "--steps", "61"}).out);
  EXPECT_EQ(more["differences"], all["differences"]);
  EXPECT_GT(more["body_steps"].get<int>(), all["body_steps"].get<int>());
}

// A generated body that is added again begins where the scene has it: only then that is looked up.
TEST_F(Branch, ABodyIsAddedWhereTheSceneHasIt) {
  record("crowd", 60);
  const std::string body = std::to_string(LogReader(log_).labels()[3]);
  write_file(inputs_, R"({"id": 9001, "type": "remove", "step": 24, "body": )" + body + "}\n" +
                          R"({"id": 9002, "type": "add", "step": 30, "body": )" + body + "}\n");
  const json all = json::parse(branched(23, {"--log", branch_, "--json"}).out);
  const Options run = {
      "run", library_file("crowd"), "--steps", "60", "--inputs", inputs_, "--json", "--quiet"};
  EXPECT_EQ(all["digest"], json::parse(run_soda(run).out)["digest"]);
  expect_the_same_of_the_cone(23, all, "crowd");
  const json few = json::parse(branched(23, {"--json"}).out);
  EXPECT_LT(few["body_steps"].get<int>(), all["body_steps"].get<int>() / 5);
}

// Without the end of a log nobody knows where bodies are in its last steps.
TEST_F(Branch, OfALogThatIsCutAllIsComputed) {
  record("crowd", 50);
  write_file(inputs_, push(9001, 20, static_cast<int>(LogReader(log_).labels().front())));
  const std::string text = analysis_test::read_file(log_);
  write_file(log_, text.substr(0, text.size() / 2));
  const std::int64_t last = LogReader(log_).last_step();
  ASSERT_GT(last, 20);
  const json cut = json::parse(branched(20, {"--json"}).out);
  const json all = json::parse(branched(20, {"--log", branch_, "--json"}).out);
  EXPECT_EQ(cut["steps"], last);
  EXPECT_EQ(cut["digest"], all["digest"]);
  EXPECT_EQ(cut["differences"], all["differences"]);
}

// A walker is pushed who touches nobody: it alone differs at first.
TEST_F(Branch, TellsHowManyBodiesDifferAndHowFarTheyAre) {
  record("crowd", 60);
  write_file(inputs_, "");
  const json same = json::parse(branched(10, {"--json"}).out);
  for (const json& step : same["differences"]) EXPECT_EQ(step["bodies"], 0) << step;
  EXPECT_EQ(same["differences"].size(), 50u);
  EXPECT_TRUE(contains(branched(10).out, "no step differs"));

  const auto label = static_cast<int>(LogReader(log_).labels().front());
  write_file(inputs_, push(9001, 20, label));
  const json pushed = json::parse(branched(10, {"--json"}).out);
  for (const json& step : pushed["differences"]) {
    const bool is_before = step["step"].get<int>() <= 20;
    EXPECT_EQ(step["bodies"].get<int>() > 0, !is_before) << step;
    EXPECT_EQ(step["deviation_m"].get<double>() > 0.0, !is_before) << step;
  }
  EXPECT_EQ(pushed["differences"][10]["bodies"], 1);
  EXPECT_EQ(pushed["differences"][10]["reach_m"], 0.0);
  EXPECT_GT(pushed["differences"].back()["reach_m"].get<double>(), 0.0);

  write_file(inputs_, R"({"id": 9001, "type": "remove", "step": 20, "body": )" +
                          std::to_string(label) + "}\n");
  const json removed = json::parse(branched(10, {"--json"}).out);
  EXPECT_EQ(removed["differences"][10]["on_one_side"], 1);
}

TEST_F(Branch, ItsLogIsReplayedAndViewed) {
  record("crowd", 40);
  write_file(inputs_, push(9001, 12, static_cast<int>(LogReader(log_).labels()[7])));
  ASSERT_EQ(branched(12, {"--log", branch_, "--steps", "50"}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"replay", branch_, "--threads", "2", "--worlds", "3"}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"view", branch_, "-o", folder_.file("page.html")}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"diff", log_, branch_}).exit_code, kExitCheckFailed);
}

TEST_F(Branch, WrongUsesAreRefusedWithWhatIsAllowed) {
  record("user-input", 40);
  write_file(inputs_, push(9001, 12, 4));
  const auto refused = [&](int step, const Options& more, const std::string& why) {
    const ChildResult result = branched(step, more);
    EXPECT_EQ(result.exit_code, kExitInput) << result.err;
    EXPECT_TRUE(contains(result.err, why)) << result.err;
    EXPECT_EQ(result.out, "");
  };
  refused(41, {}, "allowed: 0 to 40");
  refused(-1, {}, "allowed: 0 to 40");
  refused(13, {}, "is for step 12; the run goes on from step 13");
  refused(10, {"--steps", "9"}, "at least 10");
  refused(10, {"--log", log_, "--force"}, "--log");
  write_file(inputs_, push(1, 12, 4));  // acted at step 2
  refused(10, {}, "1");
  write_file(inputs_, push(7, 12, 4));  // acts at step 20
  refused(10, {}, "7");
  record("user-input", 40, {"--log-level", "inputs"});
  write_file(inputs_, push(9001, 12, 4));
  refused(10, {}, "no states");
}

}  // namespace
}  // namespace soda::analysis
