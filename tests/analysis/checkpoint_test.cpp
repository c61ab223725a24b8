// Runs that end and go on: through the binary.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::Meanwhile;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;
using nlohmann::json;
using Options = std::vector<std::string>;

const std::vector<Options> kOtherWays = {
    {},
    {"--executor", "sequential", "--worlds", "1"},
    {"--threads", "2", "--worlds", "7"},
    {"--executor", "virtual", "--worlds", "3", "--buffer", "5"},
    {"--balancing", "random", "--balancing-interval", "3"}};

class Checkpoint : public testing::Test {
 protected:
  static ChildResult ran(Options command, const Options& more) {
    command.insert(command.end(), more.begin(), more.end());
    return run_soda(command);
  }
  static json told(Options command, const Options& more = {}) {
    command.insert(command.end(), {"--json", "--step-digests", "--quiet"});
    const ChildResult result = ran(std::move(command), more);
    EXPECT_EQ(result.exit_code, kExitOk) << result.err;
    return result.exit_code == kExitOk ? json::parse(result.out) : json();
  }
  // Digests of the steps after `first`.
  static json digests_after(const json& run, std::size_t first) {
    const json& all = run["step_digests"];
    return json(std::vector<json>(all.begin() + static_cast<std::ptrdiff_t>(first), all.end()));
  }

  const TemporaryFolder folder_;
  const std::string file_ = folder_.file("run.sodapoint");
};

TEST_F(Checkpoint, ARunGoesOnWithTheBitsOfTheUninterruptedOneInEveryOtherWay) {
  const struct {
    const char* name;
    int steps, stop;
  } scenes[] = {{"user-input", 120, 17},   {"user-input", 120, 52},     {"crowd", 60, 23},
                {"border-stack", 100, 84}, {"breaking-bridge", 80, 41}, {"mixed-shapes", 60, 30},
                {"mill", 60, 30}};
  for (const auto& scene : scenes) {
    const Options whole_run = {"run", library_file(scene.name), "--steps",
                               std::to_string(scene.steps)};
    const json whole = told(whole_run);
    const json part = told({"run", library_file(scene.name), "--steps", std::to_string(scene.stop),
                            "--checkpoint", file_, "--every", "10", "--force"});
    EXPECT_EQ(part["digest"], whole["step_digests"][static_cast<std::size_t>(scene.stop) - 1]);
    for (const Options& way : kOtherWays) {
      if (scene.name == std::string("mill") && !way.empty() && way[0] == "--balancing") continue;
      const json on = told({"run", "--resume", file_, "--steps", std::to_string(scene.steps)}, way);
      EXPECT_EQ(on["step_digests"], digests_after(whole, static_cast<std::size_t>(scene.stop)))
          << scene.name << " from " << scene.stop << ", " << (way.empty() ? "as it was" : way[1]);
      EXPECT_EQ(on["first_step"], scene.stop);
    }
  }
}

// A timer of processor time survives exec, and its signal ends a program that does not catch it. So
// the moments are the same ones on a busy machine.
void end_after(double cpu_s) {
  const auto microseconds = static_cast<suseconds_t>(1e6 * cpu_s);
  const itimerval timer{{0, 0}, {microseconds / 1'000'000, microseconds % 1'000'000}};
  ::setitimer(ITIMER_PROF, &timer, nullptr);
}

// Whatever moment: the file is a whole checkpoint, or none was written yet.
TEST_F(Checkpoint, KilledAtAnyMomentARunLosesNothingBeforeTheLastOne) {
  const std::string digest =
      told({"run", library_file("border-stack"), "--steps", "400"})["digest"];
  const auto run_until = [&](int threads, const Meanwhile& meanwhile) {
    std::filesystem::remove(file_);
    return run_soda({"run", library_file("border-stack"), "--steps", "400", "--checkpoint", file_,
                     "--every", "3", "--quiet", "--threads", std::to_string(threads)},
                    meanwhile);
  };
  const std::array whole_cpu_s = {run_until(1, {}).cpu_s, run_until(2, {}).cpu_s};
  int killed = 0, went_on = 0;
  for (int moment = 0; moment < 50; ++moment) {
    const int threads = 1 + moment % 2;
    const double cpu_s = whole_cpu_s[static_cast<std::size_t>(moment % 2)] * (moment + 1) / 50;
    const ChildResult run = run_until(threads, {.in_child = [&] { end_after(cpu_s); }});
    killed += run.signal == SIGPROF;
    if (!std::filesystem::exists(file_)) continue;
    LogReader checkpoint(file_);
    EXPECT_TRUE(checkpoint.complete());
    const bool is_last = checkpoint.first_step() == 400;
    EXPECT_TRUE(checkpoint.first_step() % 3 == 0 || is_last) << checkpoint.first_step();
    const Options& way = kOtherWays[static_cast<std::size_t>(moment) % kOtherWays.size()];
    const json on = told({"run", "--resume", file_}, way);
    EXPECT_EQ(on["digest"], digest) << "killed at step " << on["first_step"];
    went_on += !is_last;
  }
  EXPECT_GE(killed, 25) << "most of them were still running";
  EXPECT_GE(went_on, 15) << "and had begun";
}

TEST_F(Checkpoint, EachTakesThePlaceOfTheOneBeforeAndTheRunGoesOnWritingThere) {
  const Options start = {"run", library_file("crowd"), "--steps", "25", "--checkpoint", file_};
  told(start);
  EXPECT_EQ(LogReader(file_).first_step(), 25) << "one is written at the end";
  const ChildResult refused = ran(start, {});
  EXPECT_EQ(refused.exit_code, kExitFile);
  EXPECT_TRUE(contains(refused.err, "it exists; --force replaces it")) << refused.err;
  told({"run", "--resume", file_, "--checkpoint", file_, "--steps", "40"});
  EXPECT_EQ(LogReader(file_).first_step(), 40) << "its own it may replace";
  EXPECT_EQ(folder_.files(), Options{"run.sodapoint"}) << "nothing else is left";
}

TEST_F(Checkpoint, InputsOfAFileThatHaveNotActedAreInIt) {
  const std::string inputs = folder_.file("more.jsonl");
  write_file(
      inputs,
      R"({"id": 101, "time_s": 0.25, "type": "push", "body": 0, "impulse_newton_s": [1, 0, 2]})"
      "\n"
      R"({"id": 102, "time_s": 1.0, "type": "push", "body": 0, "impulse_newton_s": [0, 2, 1]})");
  const std::string scene = library_file("user-input");
  const json whole = told({"run", scene, "--inputs", inputs});
  EXPECT_NE(whole["digest"], told({"run", scene})["digest"]);
  told({"run", scene, "--inputs", inputs, "--steps", "40", "--checkpoint", file_});
  EXPECT_EQ(told({"run", "--resume", file_, "--steps", "120"})["digest"], whole["digest"]);
  const ChildResult again =
      ran({"run", "--resume", file_, "--steps", "120", "--inputs", inputs}, {});
  EXPECT_EQ(again.exit_code, kExitInput);
  EXPECT_TRUE(contains(again.err, "101")) << again.err;
}

// Killed as soon as a checkpoint has what the stream has said for later.
TEST_F(Checkpoint, ABodyThatIsAddedAfterwardsBeginsWhereTheSceneHasIt) {
  const std::string inputs = folder_.file("inputs.jsonl");
  write_file(inputs, R"({"id": 9001, "type": "remove", "step": 30, "body": 3})"
                     "\n"
                     R"({"id": 9002, "type": "add", "step": 40, "body": 3})"
                     "\n");
  const Options scene = {"run", library_file("user-input"), "--steps", "60"};
  const json whole = told(scene, {"--inputs", inputs});
  told({"run", library_file("user-input"), "--steps", "20", "--checkpoint", file_});
  const json on = told({"run", "--resume", file_, "--steps", "60"}, {"--inputs", inputs});
  EXPECT_EQ(on["step_digests"], digests_after(whole, 20));
}

TEST_F(Checkpoint, InputsOfAStreamThatHaveNotActedAreInIt) {
  const std::string scene = library_file("user-input"), lines = folder_.file("lines.jsonl");
  write_file(
      lines,
      R"({"id": 101, "step": 5000, "type": "push", "body": 0, "impulse_newton_s": [1, 0, 2]})"
      "\n"
      R"({"id": 102, "step": 5010, "type": "push", "body": 0, "impulse_newton_s": [0, 2, 1]})"
      "\n");
  const json whole = told({"run", scene, "--steps", "5050", "--inputs", lines});
  const auto knows_both = [this] {
    if (!std::filesystem::exists(file_)) return false;
    LogReader checkpoint(file_);
    const LoggedStep step = checkpoint.read_step(checkpoint.first_step());
    return std::ranges::count_if(step.inputs, [](const models::CommittedInput& known) {
             return known.input.id > 100;
           }) == 2;
  };
  std::size_t way = 0;
  for (const char* threads : {"1", "2"}) {
    const ChildResult run = run_soda(
        {"run", scene, "--steps", "5050", "--threads", threads, "--realtime", "--speed", "20",
         "--inputs", "-", "--checkpoint", file_, "--every", "10", "--quiet", "--force"},
        {.in_child = [lines] { dup2(open(lines.c_str(), O_RDONLY), STDIN_FILENO); },
         .here =
             [&](int child) {
               while (!knows_both()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
               ::kill(child, SIGKILL);
             }});
    ASSERT_EQ(run.signal, SIGKILL) << run.err;
    const json on = told({"run", "--resume", file_}, kOtherWays[way++]);
    EXPECT_GT(on["first_step"], 0);
    EXPECT_LT(on["first_step"], 5000);
    EXPECT_EQ(on["digest"], whole["digest"]);
    std::filesystem::remove(file_);
  }
}

// What asks for no step acts first, and what comes then comes as in any run.
TEST_F(Checkpoint, AStreamGoesOnWithTheRun) {
  const std::string lines = folder_.file("lines.jsonl"), log = folder_.file("on.sodalog");
  write_file(lines, R"({"id": 101, "type": "push", "body": 0, "impulse_newton_s": [1, 0, 2]})"
                    "\n");
  told({"run", library_file("user-input"), "--steps", "40", "--checkpoint", file_});
  for (const Options& way : kOtherWays) {
    Options command = {"run",  "--resume", file_,     "--inputs", "-", "--steps",
                       "2000", "--json",   "--quiet", "--log",    log, "--force"};
    command.insert(command.end(), way.begin(), way.end());
    const ChildResult on = run_soda(
        command, {[lines] { dup2(open(lines.c_str(), O_RDONLY), STDIN_FILENO); }, [](int) {}});
    ASSERT_EQ(on.exit_code, kExitOk) << on.err;
    const json run = json::parse(on.out);
    EXPECT_GE(run["inputs"].back()["step"], 40);
    const ChildResult again = run_soda({"replay", log, "--worlds", "1"});
    EXPECT_EQ(again.exit_code, kExitOk) << again.err;
  }
}

TEST_F(Checkpoint, ARunGoesOnInRealTime) {
  const json whole = told({"run", library_file("user-input")});
  told({"run", library_file("user-input"), "--steps", "40", "--checkpoint", file_});
  for (const Options& way : kOtherWays) {
    const json on =
        told({"run", "--resume", file_, "--steps", "120", "--realtime", "--speed", "4"}, way);
    EXPECT_EQ(on["step_digests"], digests_after(whole, 40)) << (way.empty() ? "as it was" : way[1]);
    const json& shown = on["real_time"]["clock"];
    EXPECT_EQ(shown.front(), 40);
    EXPECT_EQ(shown.back(), 120);
    EXPECT_TRUE(std::ranges::is_sorted(shown.get<std::vector<int>>()));
  }
}

TEST_F(Checkpoint, ALogOfARunThatGoesOnIsReplayedAndGoesOnItself) {
  const std::string log = folder_.file("part.sodalog");
  const json whole = told({"run", library_file("user-input")});
  told({"run", library_file("user-input"), "--steps", "50", "--checkpoint", file_});
  for (const std::string level : {"inputs", "commits", "trace"}) {
    told(
        {"run", "--resume", file_, "--steps", "90", "--log", log, "--force", "--log-level", level});
    const ChildResult replayed = run_soda({"replay", log, "--threads", "2", "--worlds", "5"});
    EXPECT_EQ(replayed.exit_code, kExitOk) << replayed.err;
    EXPECT_EQ(LogReader(log).first_step(), 50);
    EXPECT_EQ(LogReader(log).last_step(), 90);
    EXPECT_EQ(run_soda({"log", log}).exit_code, kExitOk);
    const json on = told({"run", "--resume", log, "--steps", "120"});
    EXPECT_EQ(on["digest"], whole["digest"]);
    EXPECT_EQ(on["first_step"], level == "inputs" ? 50 : 90) << "the last states that it has";
  }
  EXPECT_EQ(run_soda({"view", log, "--force"}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"why", log}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"replay", log, "--step", "70"}).exit_code, kExitOk);
  const ChildResult before = run_soda({"replay", log, "--step", "20"});
  EXPECT_EQ(before.exit_code, kExitInput);
  EXPECT_TRUE(contains(before.err, "allowed: 50 to 90")) << before.err;
}

TEST_F(Checkpoint, WhatCannotGoOnSaysWhy) {
  const std::string scene = library_file("border-stack");
  const std::string log = folder_.file("inputs.sodalog");
  told({"run", scene, "--steps", "20", "--log", log, "--log-level", "inputs"});
  told({"run", scene, "--steps", "20", "--checkpoint", file_});
  write_file(folder_.file("text"), "no checkpoint");
  const struct {
    Options command;
    int exit_code;
    std::string says;
  } cases[] = {
      {{"run"}, kExitInput, "FILE is required, or --resume"},
      {{"run", scene, "--resume", file_}, kExitInput, "excludes"},
      {{"run", "--resume", log}, kExitInput, "has no states"},
      {{"run", "--resume", folder_.file("text")}, kExitFile, "is no soda log"},
      {{"run", "--resume", folder_.file("none")}, kExitFile, "cannot be read"},
      {{"run", "--resume", file_, "--steps", "19"}, kExitInput, "allowed: at least 20"},
      {{"run", "--resume", file_, "--log", file_, "--force"},
       kExitInput,
       "is the file that is read"},
      {{"run", scene, "--every", "5"}, kExitInput, "--checkpoint"},
      {{"run", scene, "--checkpoint", folder_.file("w"), "--rollback", "warm", "--threads", "2"},
       kExitInput,
       "cannot be had again"}};
  for (const auto& c : cases) {
    const ChildResult result = run_soda(c.command);
    EXPECT_EQ(result.exit_code, c.exit_code) << result.err;
    EXPECT_TRUE(contains(result.err, c.says)) << result.err;
    EXPECT_EQ(result.out, "");
  }
}

TEST_F(Checkpoint, ThatCannotBeWrittenEndsTheRunWithTheOneBefore) {
  const std::string inside = folder_.file("sub");
  std::filesystem::create_directory(inside);
  const ChildResult result =
      run_soda({"run", library_file("crowd"), "--checkpoint", inside + "/c", "--every", "10"},
               {.in_child = [] {},
                .here =
                    [&](int) {
                      while (!std::filesystem::exists(inside + "/c"))
                        std::this_thread::sleep_for(std::chrono::milliseconds(1));
                      std::filesystem::rename(inside, folder_.file("moved"));
                    }});
  EXPECT_EQ(result.exit_code, kExitFile) << result.err;
  EXPECT_TRUE(contains(result.err, "cannot be written")) << result.err;
  EXPECT_TRUE(contains(result.out, "ended early by a failure")) << result.out;
  EXPECT_TRUE(LogReader(folder_.file("moved") + "/c").complete());
}

}  // namespace
}  // namespace soda::analysis
