// Runs that are ended before their end: by signals, full disks, too little memory.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <regex>
#include <thread>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/process/stop_signals.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/runs/plain_loop.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::Meanwhile;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;

using Words = std::vector<std::string>;

std::string first_match(const std::string& text, const std::string& pattern) {
  std::smatch match;
  return std::regex_search(text, match, std::regex(pattern)) ? match[1].str() : "(none)";
}

std::string partial_of(const std::string& log) {
  const std::filesystem::path path(log);
  for (const auto& entry : std::filesystem::directory_iterator(path.parent_path()))
    if (entry.path().string().ends_with(".partial")) return entry.path();
  return "";
}

// Sends the signal when the log has some steps.
Meanwhile signalled(const std::string& log, int number) {
  return {[] { alarm(100); },
          [log, number](int child) {
            for (int looks = 0; looks < 6000; ++looks) {
              const std::string partial = partial_of(log);
              if (!partial.empty() && std::filesystem::file_size(partial) > 40000) break;
              std::this_thread::sleep_for(std::chrono::milliseconds(10));
            }
            kill(child, number);
          }};
}

class Signals : public testing::TestWithParam<Words> {};

TEST_P(Signals, EndARunAtACommitWithReportDigestAndAClosedLog) {
  for (const int number : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    const std::string log = folder.file("run.sodalog");
    Words command = {"run", library_file("border-stack"), "--steps", "10000000", "--log", log};
    command.insert(command.end(), GetParam().begin(), GetParam().end());
    const ChildResult run = run_soda(command, signalled(log, number));
    EXPECT_EQ(run.exit_code, 128 + number) << run.err << " signal " << run.signal;
    EXPECT_EQ(run.err, "");
    EXPECT_TRUE(contains(run.out, number == SIGINT ? "ended early by SIGINT, after step "
                                                   : "ended early by SIGTERM, after step "))
        << run.out;
    const std::string steps = first_match(run.out, ", after step ([0-9]+) of 10000000");
    const std::string digest = first_match(run.out, "after the last step  ([0-9a-f]{16})");
    LogReader reader(log);
    EXPECT_TRUE(reader.complete());
    EXPECT_EQ(std::to_string(reader.last_step()), steps);
    EXPECT_EQ(format_digest(reader.read_step(reader.last_step()).digest), digest);
    EXPECT_EQ(partial_of(log), "");
    const ChildResult replay = run_soda({"replay", log});
    EXPECT_EQ(replay.exit_code, kExitOk) << replay.err;
    EXPECT_TRUE(contains(replay.out, " " + steps + " steps replayed")) << replay.out;
    EXPECT_TRUE(contains(replay.out, digest)) << replay.out;
  }
}

INSTANTIATE_TEST_SUITE_P(Executors, Signals,
                         testing::Values(Words{}, Words{"--executor", "sequential"},
                                         Words{"--worlds", "1"}, Words{"--threads", "1"},
                                         Words{"--threads", "2"},
                                         Words{"--threads", "2", "--policy", "lockstep"},
                                         Words{"--executor", "virtual"},
                                         Words{"--executor", "virtual", "--policy", "lockstep"}));

TEST(Signals, AreToldInJson) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog");
  const ChildResult run =
      run_soda({"run", library_file("border-stack"), "--steps", "10000000", "--log", log, "--json"},
               signalled(log, SIGTERM));
  EXPECT_EQ(run.exit_code, 143) << run.err;
  EXPECT_TRUE(contains(run.out, "\"ended_early\": \"SIGTERM\"")) << run.out;
  EXPECT_TRUE(
      contains(run_soda({"run", library_file("border-stack"), "--steps", "1", "--json"}).out,
               "\"ended_early\": null"));
}

TEST(Signals, ASecondOneEndsAtOnceUnlessItIsAnEcho) {
  kernel::StopRequest stop{0};
  EXPECT_EXIT(
      {
        const StopOnSignals signals(stop);
        raise(SIGINT);
        raise(SIGTERM);  // at once
        if (stop.load() != SIGINT) _exit(1);
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        raise(SIGTERM);
        _exit(2);
      },
      testing::KilledBySignal(SIGTERM), "");
}

TEST(Signals, ThatWereIgnoredStaySo) {
  kernel::StopRequest stop{0};
  const auto before = std::signal(SIGINT, SIG_IGN);
  {
    const StopOnSignals signals(stop);
    raise(SIGINT);
  }
  raise(SIGINT);
  std::signal(SIGINT, before);
  EXPECT_EQ(stop.load(), 0u);
}

scenarios::Scenario short_run(const std::string& scene, models::ExecutorKind executor,
                              unsigned threads, std::uint64_t seed) {
  scenarios::Scenario scenario = load_scenario(library_file(scene), {});
  scenario.run.steps = 60;
  scenario.run.executor = executor;
  scenario.run.threads = threads;
  scenario.run.scheduling_seed = seed;
  scenario.run.cluster.processors = scenario.territory.worlds;
  scenario.run.buffer = 6;
  return scenario;
}

// What was committed is the plain loop's, and nothing is left over.
void stop_at(std::int64_t when, scenarios::Scenario scenario, const PlainLoop& oracle) {
  kernel::StopRequest stop{0};
  scenario.run.stop = &stop;
  models::CommitObserver observer;
  std::int64_t last = 0;
  observer.on_step = [&](const models::CommittedStep& step) {
    last = step.step;
    if (step.step == when) stop.store(5);
  };
  const MeasuredRun run =
      measure_run(scenario.scene, scenario.initial, scenario.territory, scenario.run, observer, {});
  ASSERT_EQ(run.result.committed_steps, last);
  ASSERT_GE(last, when);
  EXPECT_EQ(run.result.stopped, last < scenario.run.steps ? 5u : 0u);
  // Threads may have done all of it before they next look.
  if (scenario.run.executor == models::ExecutorKind::kSequential) {
    EXPECT_EQ(last, when);
  } else if (scenario.run.executor == models::ExecutorKind::kVirtual && when < 40) {
    EXPECT_LT(last, scenario.run.steps);
  }
  EXPECT_EQ(run.digest, oracle.digest_after(last));
  EXPECT_LT(run.error.momentum_drift_rel, 1e-12);
}

TEST(Stop, AtAnyStepLeavesTheStatesOfTheStepsCommitted) {
  using Kind = models::ExecutorKind;
  struct Execution {
    Kind executor;
    unsigned threads;
    std::uint64_t seed;
  };
  for (const char* scene : {"border-stack", "third-world", "user-input"}) {
    const scenarios::Scenario whole = short_run(scene, Kind::kSequential, 1, 0);
    const PlainLoop oracle(whole);
    for (const auto& [executor, threads, seed] : {Execution{Kind::kSequential, 1, 0},
                                                  {Kind::kThreads, 1, 0},
                                                  {Kind::kThreads, 2, 0},
                                                  {Kind::kThreads, 2, 3},
                                                  {Kind::kThreads, 4, 0},
                                                  {Kind::kVirtual, 1, 0}})
      for (const std::int64_t when : {1, 2, 17, 30, 58}) {
        SCOPED_TRACE(std::string(scene) + ", " + name_of(executor) + ", " +
                     std::to_string(threads) + " threads, step " + std::to_string(when));
        stop_at(when, short_run(scene, executor, threads, seed), oracle);
      }
  }
}

// As on a disk that is full after some steps.
TEST(FullDisks, EndARunAtOnceWithWhatIsKnown) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog");
  const Meanwhile limited{[] {
                            alarm(100);
                            const rlimit size{100'000, 100'000};
                            setrlimit(RLIMIT_FSIZE, &size);
                          },
                          [](int) {}};
  const ChildResult run =
      run_soda({"run", library_file("border-stack"), "--steps", "10000000", "--log", log}, limited);
  EXPECT_EQ(run.exit_code, kExitFile) << run.err << " signal " << run.signal;
  EXPECT_TRUE(contains(run.err, "File too large")) << run.err;
  EXPECT_TRUE(contains(run.out, "ended early by a failure, after step ")) << run.out;
  EXPECT_FALSE(std::filesystem::exists(log));
  const std::string partial = partial_of(log);
  EXPECT_TRUE(contains(run.err, partial + " holds the log up to step ")) << run.err;
  const std::string last = first_match(run.err, "up to step ([0-9]+)");
  const ChildResult replay = run_soda({"replay", partial});
  EXPECT_EQ(replay.exit_code, kExitOk) << replay.err;
  EXPECT_TRUE(contains(replay.out, " " + last + " steps replayed")) << replay.out;
}

TEST(TooLittleMemory, IsToldWithWhatWasAskedFor) {
  const Meanwhile limited{[] {
                            alarm(100);
                            const rlimit memory{1ul << 30, 1ul << 30};
                            setrlimit(RLIMIT_AS, &memory);
                          },
                          [](int) {}};
  const ChildResult run = run_soda(
      {"run", library_file("twelve-worlds"), "--threads", "1", "--buffer", "1000000"}, limited);
  EXPECT_EQ(run.exit_code, kExitFile) << run.err << " signal " << run.signal;
  EXPECT_TRUE(contains(run.err, "not enough memory for ")) << run.err;
  EXPECT_TRUE(contains(run.err, "12 worlds")) << run.err;
  EXPECT_TRUE(contains(run.err, "buffers of 1000000 entries")) << run.err;
}

}  // namespace
}  // namespace soda::analysis
