// What one event of PHOLD costs in instructions: unlike a time, that does not depend on the load of
// the machine, so that a slip shows.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"

namespace soda::kernel {
namespace {

using analysis_test::ChildResult;
using analysis_test::run_child;
using analysis_test::TemporaryFolder;

struct CountedRun {
  double instructions = 0;
  double events = 0;
};

// The number after `key` in `text`.
double number_after(const std::string& text, const std::string& key) {
  const std::size_t at = text.find(key);
  return at == std::string::npos ? 0.0 : std::stod(text.substr(at + key.size()));
}

CountedRun count(const std::vector<std::string>& valgrind_options,
                 const std::vector<std::string>& phold_options, const std::string& end) {
  const TemporaryFolder folder;
  std::vector<std::string> argv = {"/usr/bin/valgrind", "--tool=callgrind",
                                   "--callgrind-out-file=" + folder.file("callgrind.out")};
  argv.insert(argv.end(), valgrind_options.begin(), valgrind_options.end());
  argv.insert(argv.end(), {SODA_BINARY_DIR "/soda", "phold", "--end", end});
  argv.insert(argv.end(), phold_options.begin(), phold_options.end());
  const ChildResult result = run_child(argv);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return {number_after(result.err, "Collected :"), number_after(result.out, "")};
}

// From virtual time 100 to `end`: neither starting the program nor filling the queues counts.
double instructions_per_event(const std::vector<std::string>& valgrind_options,
                              const std::vector<std::string>& phold_options,
                              const std::string& end = "200") {
  const CountedRun start = count(valgrind_options, phold_options, "100");
  const CountedRun whole = count(valgrind_options, phold_options, end);
  EXPECT_GT(start.instructions, 0.0);
  EXPECT_GT(whole.events, start.events + 100000);
  const double per_event =
      (whole.instructions - start.instructions) / (whole.events - start.events);
  std::cout << per_event << " instructions per event\n";
  return per_event;
}

// Ceilings: what was measured in a build as soda.sh makes it, and a tenth more.
TEST(InstructionCount, OfTheSequentialExecutor) {
  EXPECT_LE(instructions_per_event({}, {"--executor", "sequential"}), 1.1 * 648);
}

// Of choosing, executing, sending and delivering; how many bags lie between two looks at the clock
// and at the inbox depends on the speed of the machine, so that part of the loop does not count.
TEST(InstructionCount, OfTimeWarpOnOneThread) {
  EXPECT_LE(instructions_per_event({"--toggle-collect=soda::kernel::Worker::execute_arrived*"},
                                   {"--executor", "threads", "--threads", "1"}),
            1.1 * 731);
}

// Of committing and collecting fossils. How much a batch leaves to commit depends on its length,
// and that on the speed of the machine: over four times the events the spread is a twenty-fifth of
// the count (178 to 191 with five other processes on two cores); the median of three counts.
TEST(InstructionCount, OfCommittingOnOneThread) {
  std::array<double, 3> counts{};
  for (double& count : counts)
    count = instructions_per_event({"--toggle-collect=soda::kernel::Worker::collect_journal*"},
                                   {"--executor", "threads", "--threads", "1"}, "500");
  std::ranges::sort(counts);
  EXPECT_LE(counts[1], 1.1 * 184);
}

// The whole command on one thread over the sequential one, with the same model.
double instructions_over_sequential(std::vector<std::string> model, const std::string& end) {
  const CountedRun sequential = count({}, model, end);
  model.insert(model.end(), {"--executor", "threads", "--threads", "1"});
  const CountedRun optimistic = count({}, model, end);
  EXPECT_GT(sequential.events, 200000);
  EXPECT_EQ(optimistic.events, sequential.events);
  const double ratio = optimistic.instructions / sequential.instructions;
  std::cout << ratio << " of the sequential instructions\n";
  return ratio;
}

// A round of GVT or a choice that looked at every LP would multiply these.
TEST(InstructionCount, WithAHundredThousandLpsOnOneThreadIsNearTheSequentialOne) {
  EXPECT_LE(instructions_over_sequential({"--lps", "131072"}, "2"), 1.1 * 2.23);
}

// Each LP sends so many messages, each to a time of its own, before anything else happens.
TEST(InstructionCount, WithFortyThousandMessagesAheadIsNearTheSequentialOne) {
  EXPECT_LE(instructions_over_sequential({"--lps", "2", "--start-events", "40000"}, "3"),
            1.1 * 1.66);
}

}  // namespace
}  // namespace soda::kernel
