// What commands make of logs that are sound by their checksums, but hold what no run can have.
#include "analysis/forged_log.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <random>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/event_log/single_states.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/trace/recorded_order.hpp"
#include "analysis/trace/recorded_walk.hpp"
#include "analysis/trace/why_command.hpp"
#include "analysis/viewer/recording.hpp"
#include "analysis/viewer/view_page.hpp"
#include "physics/measures/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::forge_log;
using analysis_test::ForgedBlock;
using analysis_test::library_file;
using analysis_test::Meanwhile;
using analysis_test::overwrite;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;

// What hangs is ended, and what takes memory without bound fails.
const Meanwhile kWithinLimits{[] {
                                alarm(60);
                                const rlimit memory{3ul << 30, 3ul << 30};
                                setrlimit(RLIMIT_AS, &memory);
                              },
                              [](int) {}};

class Logs : public testing::Test {
 protected:
  // user-input: bodies, inputs; with changing territories.
  void SetUp() override {
    const ChildResult run =
        run_soda({"run", library_file("user-input"), "--steps", "40", "--executor", "virtual",
                  "--worlds", "4", "--balancing", "random", "--balancing-interval", "2", "--buffer",
                  "4", "--log", log_});
    ASSERT_EQ(run.exit_code, kExitOk) << run.err;
  }

  // All commands that read logs end with an error that names the log, and none crashes.
  void expect_refused(const std::string& place) {
    for (const auto& command :
         {std::vector<std::string>{"replay", forged_}, {"view", forged_, "--force", "-o", page_}}) {
      const ChildResult told = run_soda(command, kWithinLimits);
      EXPECT_EQ(told.exit_code, kExitFile) << command[0] << told.err << " signal " << told.signal;
      EXPECT_TRUE(contains(told.err, place)) << command[0] << ": " << told.err;
      EXPECT_EQ(told.out, "");
    }
    const ChildResult shown = run_soda({"replay", forged_, "--step", "20"}, kWithinLimits);
    EXPECT_TRUE(shown.exit_code == kExitOk || shown.exit_code == kExitFile) << shown.err;
  }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.file("sound.sodalog"), forged_ = folder_.file("forged.sodalog"),
                    page_ = folder_.file("page.html");
};

TEST_F(Logs, AWrongIdIsToldAndNothingCrashes) {
  for (const std::uint32_t id : {0x7ffffff0u, 0xffffffffu, 1000u}) {
    analysis_test::rewrite_log(log_, forged_, [id](LoggedStep& step) {
      if (step.step == 20) step.ids.back() = physics::BodyId{id};  // the order is right
    });
    expect_refused("block 23 (step 20) at byte ");
  }
}

TEST_F(Logs, IdsOutOfOrderAreTold) {
  analysis_test::rewrite_log(log_, forged_, [](LoggedStep& step) {
    if (step.step == 20) step.ids[0] = step.ids[1];
  });
  expect_refused("block 23 (step 20) at byte ");
}

TEST_F(Logs, AWrongStepNumberIsTold) {
  forge_log(log_, forged_, [](ForgedBlock& block) {
    if (block.step == 20) overwrite(block.payload, 0, std::int64_t{21});
  });
  expect_refused("block 23 (step 20) at byte ");
}

TEST_F(Logs, AnUnknownExecutorIsTold) {
  for (const std::uint64_t executor : {77u, 4u}) {
    forge_log(log_, forged_, [executor](ForgedBlock& block) {
      if (block.type != BlockType::kOptions) return;
      overwrite(block.payload, 0, std::uint8_t{1});
      overwrite(block.payload, 1, executor);
    });
    expect_refused("block 1 at byte ");
    const ChildResult told = run_soda({"replay", forged_});
    EXPECT_TRUE(contains(told.err, std::to_string(executor) + " for the executor")) << told.err;
  }
}

TEST_F(Logs, RanksWithoutAJobAreTold) {
  forge_log(log_, forged_, [](ForgedBlock& block) {
    if (block.type != BlockType::kOptions) return;
    overwrite(block.payload, 0, std::uint8_t{1});
    overwrite(block.payload, 1, static_cast<std::uint64_t>(models::ExecutorKind::kMpi));
  });
  expect_refused("block 1 at byte ");
}

TEST_F(Logs, OptionsThatAreOutOfRangeAreTold) {
  for (const std::size_t option : {1u, 2u, 3u})  // threads, worlds, buffer
    for (const std::uint64_t value : {std::uint64_t{0}, ~std::uint64_t{0}}) {
      forge_log(log_, forged_, [=](ForgedBlock& block) {
        if (block.type != BlockType::kOptions) return;
        overwrite(block.payload, 9 * option, std::uint8_t{1});
        overwrite(block.payload, 9 * option + 1, value);
      });
      expect_refused("block 1 at byte ");
    }
}

TEST_F(Logs, BodiesThatTheScenarioDoesNotHaveAreTold) {
  forge_log(log_, forged_, [](ForgedBlock& block) {
    if (block.type == BlockType::kBodies) overwrite(block.payload, 8, std::uint32_t{12345});
  });
  expect_refused("block 2 lists body 12345");
}

// The inputs and territories of a step, taken apart and put together again.
void change_step(const std::string& from, const std::string& to,
                 const std::function<bool(LoggedStep&)>& change) {
  bool is_done = false;
  analysis_test::rewrite_log(from, to, [&](LoggedStep& step) {
    if (!is_done) is_done = change(step);
  });
  ASSERT_TRUE(is_done);
}

TEST_F(Logs, InputsThatNoRunCanHaveAreTold) {
  using Change = void (*)(models::UserInput&);
  for (const Change change :
       {Change([](models::UserInput& input) { input.body = physics::BodyId{0x7ffffff0}; }),
        Change([](models::UserInput& input) { input.kind = models::InputKind{9}; }),
        Change([](models::UserInput& input) { input.step += 1; }),
        Change([](models::UserInput& input) { input.impulse_newton_s.x() = std::nan(""); })}) {
    change_step(log_, forged_, [change](LoggedStep& step) {
      if (step.inputs.empty()) return false;
      change(step.inputs[0].input);
      return true;
    });
    expect_refused(") at byte ");
  }
}

TEST_F(Logs, CellsAndWorldsThatThereAreNotAreTold) {
  using Change = void (*)(models::TerritoryChange&);
  for (const Change change :
       {Change([](models::TerritoryChange& c) { c.cell = 0xfffffff0; }),
        Change([](models::TerritoryChange& c) { c.from = models::WorldId{4}; }),
        Change([](models::TerritoryChange& c) { c.to = models::WorldId{0xffffffff}; })}) {
    change_step(log_, forged_, [change](LoggedStep& step) {
      if (step.territory_changes.empty()) return false;
      change(step.territory_changes[0]);
      return true;
    });
    expect_refused(") at byte ");
  }
}

TEST_F(Logs, AnEndThatIsNotThatOfTheStepsIsTold) {
  for (const std::size_t field : {0u, 8u}) {
    forge_log(log_, forged_, [field](ForgedBlock& block) {
      if (block.type == BlockType::kEnd) overwrite(block.payload, field, std::uint64_t{7});
    });
    expect_refused("(end) at byte ");
  }
}

// Each body by itself, and what else is there for who reads only some.
void read_parts(LogReader& log, std::mt19937& random) {
  SingleStates single(log);
  for (std::int64_t step = 0; step <= log.last_step(); ++step)
    single.read(physics::BodyId{static_cast<std::uint32_t>(random() % log.labels().size())}, step);
  for (std::int64_t step = 0; step < log.last_step(); step += kBoundedSteps) log.read_bounds(step);
  log.read_last_states();
}

// Reads all that there is, of a log of four worlds. `shows` gets whether a digest is not that of
// its states.
void read_whole(const std::string& file, bool runs_again, std::mt19937& random, bool& shows) {
  LogReader log(file);
  for (std::int64_t step = 0; step <= log.last_step(); ++step) {
    const LoggedStep logged = log.read_step(step);
    for (const physics::BodyId id : logged.ids)
      ASSERT_LT(physics::index_of(id), log.labels().size());
    shows = shows || physics::digest(logged.ids, logged.states) != logged.digest;
  }
  read_parts(log, random);
  const ExecutionTrace trace = read_trace(log, 4);
  for (RollbackNumber number = 0; number < trace.rollbacks.size(); ++number)
    ASSERT_FALSE(why_text(trace, number, log.labels()).empty());
  const RecordedWalk walk = recorded_walk(log, 4);
  ASSERT_FALSE(situation_text(situation_after(walk, walk.size(), 4), 48).empty());
  for (const WalkedHappening& happening : walk) ASSERT_FALSE(happening_text(happening).empty());
  if (!runs_again) return;
  const scenarios::Scenario scenario = logged_scenario(log, {});
  ASSERT_FALSE(view_page(record(log, scenario, 20), timeline_of(log, scenario)).empty());
  if (!walk.empty()) stands_as_executed(log, scenario, walk, random() % walk.size());
}

// One to three bytes of one block are others, and every checksum fits: what can be read is read,
// the rest is told, or shows in a digest. In this process: a crash would end the test.
TEST(ForgedLogs, AThousandAreReadOrTold) {
  const TemporaryFolder folder;
  const std::string sound = folder.file("sound.sodalog"), forged = folder.file("forged.sodalog");
  std::size_t told = 0;
  std::mt19937 random(11);
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{library_file("border-stack"), "--executor", "virtual", "--gating",
                                 "off"},
        {library_file("user-input"), "--executor", "virtual", "--balancing", "random"},
        {library_file("user-input"), "--executor", "sequential"}}) {
    std::vector<std::string> command = {"run", "--steps",     "100",   "--log",
                                        sound, "--log-level", "trace", "--force"};
    command.insert(command.end(), options.begin(), options.end());
    ASSERT_EQ(run_soda(command).exit_code, kExitOk);
    std::size_t blocks = 0;
    forge_log(sound, forged, [&blocks](ForgedBlock&) { ++blocks; });
    for (int trial = 0; trial < 334; ++trial) {
      std::size_t left = random() % blocks;
      forge_log(sound, forged, [&](ForgedBlock& block) {
        if (left-- != 0) return;
        for (std::size_t change = 1 + random() % 3; change > 0 && !block.payload.empty(); --change)
          block.payload[random() % block.payload.size()] ^=
              static_cast<unsigned char>(1 + random() % 255);
      });
      bool shows = false;
      try {
        read_whole(forged, trial % 10 == 0, random, shows);
        told += shows ? 1 : 0;
      } catch (const scenarios::FileError&) {
        ++told;
      } catch (const scenarios::InputError&) {
        ++told;
      } catch (const UsageError&) {
        ++told;
      } catch (const kernel::NotAsRecorded&) {
        ++told;
      }
    }
  }
  EXPECT_GT(told, 500u);
}

// More than any step has, of a block or really there; within 3 GiB of address space.
TEST_F(Logs, ABlockThatHoldsMoreThanAnyIsRefusedWithLittleMemory) {
  forge_log(log_, forged_, [](ForgedBlock& block) {
    if (block.step == 0) block.claimed = std::uint64_t{1} << 32;
  });
  const ChildResult claimed = run_soda({"replay", forged_}, kWithinLimits);
  EXPECT_EQ(claimed.exit_code, kExitFile) << claimed.err;
  EXPECT_TRUE(contains(claimed.err, "block 3 (step 0) at byte ")) << claimed.err;
  EXPECT_TRUE(contains(claimed.err, "allowed: at most 67")) << claimed.err;
  EXPECT_LT(claimed.peak_rss_kib, 200 << 10);
  forge_log(log_, forged_, [](ForgedBlock& block) {
    if (block.step == 0) block.payload.assign(std::size_t{500} << 20, 0);
  });
  const ChildResult real = run_soda({"replay", forged_}, kWithinLimits);
  EXPECT_EQ(real.exit_code, kExitFile) << real.err;
  EXPECT_LT(real.peak_rss_kib, 200 << 10);
}

TEST_F(Logs, AFifoIsNoLog) {
  ASSERT_EQ(mkfifo(forged_.c_str(), 0600), 0);
  const ChildResult told = run_soda({"replay", forged_}, kWithinLimits);
  EXPECT_EQ(told.exit_code, kExitFile) << told.err << " signal " << told.signal;
  EXPECT_TRUE(contains(told.err, "no regular file")) << told.err;
}

// A replay is over when it is known to differ: it takes less time than one that goes on.
TEST_F(Logs, AReplayEndsAtTheFirstDivergenceAndNamesIt) {
  const std::string sound = folder_.file("long.sodalog");
  ASSERT_EQ(
      run_soda({"run", library_file("twelve-worlds"), "--steps", "600", "--log", sound}).exit_code,
      kExitOk);
  analysis_test::rewrite_log(sound, forged_, [](LoggedStep& step) {
    if (step.step == 2) step.states[7].linear_velocity_m_s.y() = 0.25;
  });
  const ChildResult whole = run_soda({"replay", sound});
  const ChildResult ended = run_soda({"replay", forged_});
  EXPECT_EQ(whole.exit_code, kExitOk) << whole.err;
  EXPECT_EQ(ended.exit_code, kExitCheckFailed) << ended.err;
  EXPECT_TRUE(contains(ended.err, "divergence at step 2: body ")) << ended.err;
  EXPECT_TRUE(contains(ended.err, "field linear_velocity")) << ended.err;
  EXPECT_TRUE(contains(ended.err, "logged 0.25 (0x3fd0000000000000), replayed ")) << ended.err;
  EXPECT_LT(ended.cpu_s, 0.6 * whole.cpu_s);
}

}  // namespace
}  // namespace soda::analysis
