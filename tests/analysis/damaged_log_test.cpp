// Logs that were cut off or had bits flipped: what is told of them is an error, or right up to the
// last block that is whole.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <memory>
#include <random>
#include <sstream>

#include "analysis/child_process.hpp"
#include "analysis/commands/diff_command.hpp"
#include "analysis/commands/log_command.hpp"
#include "analysis/commands/replay_command.hpp"
#include "analysis/commands/trace_command.hpp"
#include "analysis/commands/view_command.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/trace/why_command.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;

// What a reader that takes the format at its word finds of the first `bytes` bytes.
struct Whole {
  std::int64_t steps = 0;  // step blocks that are whole
  std::size_t traces = 0;  // blocks of trace
  bool has_end = false;
};

Whole whole_before(const std::string& log, std::size_t bytes) {
  Whole whole;
  for (std::size_t at = kFileHeaderBytes; at + kBlockHeaderBytes <= log.size();) {
    const auto* data = reinterpret_cast<const unsigned char*>(log.data()) + at;
    const BlockHeader header = decode_block_header({data, kBlockHeaderBytes});
    at += kBlockHeaderBytes + header.stored_bytes;
    if (at > bytes) break;
    whole.steps += header.type == BlockType::kStep;
    whole.traces += header.type == BlockType::kTrace;
    whole.has_end = whole.has_end || header.type == BlockType::kEnd;
  }
  return whole;
}

class DamagedLogs : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const auto ran =
        run_soda({"run", library_file("border-stack"), "--steps", "60", "--executor", "virtual",
                  "--gating", "off", "--log", sound_, "--log-level", GetParam()});
    ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
    text_ = read_file(sound_);
    LogReader log(sound_);
    for (std::int64_t step = 0; step <= log.last_step(); ++step)
      digests_.push_back(log.read_step(step).digest);
    traces_ = log.traces();
  }

  // Of the damaged log, of which what lies before `bytes` is as it was.
  void expect_right_before(std::size_t bytes, bool is_cut) {
    const Whole whole = whole_before(text_, bytes);
    std::unique_ptr<LogReader> log;
    try {
      log = std::make_unique<LogReader>(damaged_);
    } catch (const scenarios::FileError&) {
      ASSERT_EQ(whole.steps, 0);
      return;
    }
    ASSERT_EQ(log->last_step() + 1, whole.steps);
    ASSERT_EQ(log->traces(), whole.traces);
    ASSERT_EQ(log->complete(), whole.has_end);
    ASSERT_NE(log->cut().empty(), log->damage().empty());
    if (is_cut) {
      ASSERT_EQ(log->damage(), "");
    }
    for (std::int64_t step = 0; step <= log->last_step(); ++step)
      ASSERT_EQ(log->read_step(step).digest, digests_[static_cast<std::size_t>(step)]);
    expect_commands_tell_so(*log);
  }

  // Each command says the same of it: nothing but what differs is missing, and an exit code of its
  // own for damage.
  void expect_commands_tell_so(const LogReader& log) {
    const int code = log.damage().empty() ? kExitOk : kExitCheckFailed;
    std::ostringstream out, err;
    const bool is_traced = log.options().level == LogLevel::kTrace;
    ASSERT_EQ(diff_command({{sound_, damaged_}, false}, out, err), code) << out.str();
    ASSERT_EQ(
        log_command({.file = damaged_, .lines = "steps", .json = false, .csv = true}, out, err),
        code);
    if (is_traced) {
      ASSERT_EQ(
          log_command({.file = damaged_, .lines = "events", .json = false, .csv = true}, out, err),
          code);
      WhyRequest why;
      why.file = damaged_;
      ASSERT_EQ(why_command(why, out, err), code);
    }
    ReplayRequest shown;
    shown.file = damaged_;
    shown.step = log.last_step();
    ASSERT_EQ(replay_command(shown, out, err), code);
    if (++checked_ % 50 != 0) return;  // what takes longer
    ReplayRequest again;
    again.file = damaged_;
    again.quiet = true;
    ASSERT_EQ(replay_command(again, out, err), code) << err.str();
    ASSERT_EQ(view_command({damaged_, folder_.file("page.html"), true, {}}, out, err), code);
    if (!is_traced) return;
    ASSERT_EQ(trace_command({damaged_, folder_.file("trace.json"), true}, out, err), code);
    again.until = "happening:200";
    try {
      ASSERT_EQ(replay_command(again, out, err), code) << err.str();
    } catch (const UsageError&) {  // it does not have so many
      ASSERT_LT(log.traces(), traces_);
    }
  }

  const TemporaryFolder folder_;
  const std::string sound_ = folder_.file("sound.sodalog"),
                    damaged_ = folder_.file("damaged.sodalog");
  std::string text_;
  std::vector<std::uint64_t> digests_;
  std::size_t traces_ = 0;
  std::size_t checked_ = 0;
};

long peak_kib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

// With the other level two thousand in all.
TEST_P(DamagedLogs, AThousandCutsAndFlipsAreErrorsOrRightUpToTheLastWholeBlock) {
  std::mt19937 random(GetParam()[0]);
  const long before_kib = peak_kib();
  for (int trial = 0; trial < 1000 && !HasFatalFailure(); ++trial) {
    const std::size_t at = random() % text_.size();
    SCOPED_TRACE((trial % 2 == 0 ? "cut at byte " : "flipped at byte ") + std::to_string(at));
    if (trial % 2 == 0) {
      write_file(damaged_, text_.substr(0, at));
    } else {
      std::string flipped = text_;
      flipped[at] = static_cast<char>(flipped[at] ^ (1 << random() % 8));
      write_file(damaged_, flipped);
    }
    if (at < kFileHeaderBytes) {
      EXPECT_THROW(LogReader log(damaged_), scenarios::FileError);
    } else {
      expect_right_before(at, trial % 2 == 0);
    }
  }
  EXPECT_GT(checked_, 500u);
#ifndef __SANITIZE_ADDRESS__
  EXPECT_LT(peak_kib() - before_kib, 256l << 10);
#endif
}

INSTANTIATE_TEST_SUITE_P(Levels, DamagedLogs, testing::Values("trace", "commits"));

}  // namespace
}  // namespace soda::analysis
