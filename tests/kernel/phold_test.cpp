// The order-sensitive PHOLD under both executors: the same committed digest, whatever the schedule.
#include "kernel/phold.hpp"

#include <gtest/gtest.h>

#include <string>

#include "kernel/executor.hpp"

namespace soda::kernel {
namespace {

struct Outcome {
  std::uint64_t digest = 0;
  RunResult run;
  std::size_t checkpoints = 0;
};

Outcome run_oracle(const PholdOptions& model, VirtualTime end) {
  const auto lps = make_phold(model);
  Outcome outcome;
  outcome.run = run_sequential(lps, end);
  outcome.digest = phold_digest(lps);
  return outcome;
}

Outcome run_time_warp(const PholdOptions& model, VirtualTime end, const ThreadsOptions& options) {
  const auto lps = make_phold(model);
  Outcome outcome;
  outcome.run = run_threads(lps, end, options);
  outcome.digest = phold_digest(lps);
  outcome.checkpoints = phold_checkpoints(lps);
  return outcome;
}

std::string describe(const ThreadsOptions& options) {
  return "threads " + std::to_string(options.threads) + ", window " +
         std::to_string(options.window) + ", scheduling seed " +
         std::to_string(options.scheduling_seed);
}

// Ties (integer delays of 1 .. 7 ticks), zero-delay rounds, slots, payloads that rollbacks change.
PholdOptions rough_model(std::uint64_t seed) {
  return {.lps = 12,
          .start_events_per_lp = 2,
          .remote_per_mille = 500,
          .mean_delay = 4,
          .zero_delay_rounds = static_cast<std::uint32_t>(seed % 4),
          .state_carrying_per_mille = 250,
          .doubled_per_mille = 100,
          .seed = seed};
}

TEST(Phold, HundredSeedsCommitTheSequentialDigestUnderEverySchedule) {
  const VirtualTime end{40, 0};
  std::uint64_t rollbacks = 0;
  std::uint64_t adopted = 0;
  std::uint64_t anti_messages = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const PholdOptions model = rough_model(seed);
    const Outcome oracle = run_oracle(model, end);
    for (const unsigned threads : {1u, 2u, 4u}) {
      for (const std::int64_t window : {1, 4, 48}) {
        for (const std::uint64_t scheduling_seed : {std::uint64_t{0}, seed}) {
          const ThreadsOptions options{threads, window, scheduling_seed};
          const Outcome outcome = run_time_warp(model, end, options);
          ASSERT_EQ(outcome.digest, oracle.digest) << describe(options) << ", seed " << seed;
          ASSERT_EQ(outcome.run.counters.committed, oracle.run.counters.committed);
          const Counters& work = outcome.run.counters;
          ASSERT_EQ(work.executed - work.rolled_back, work.committed) << describe(options);
          ASSERT_LT(work.lead_max, static_cast<std::uint64_t>(window)) << describe(options);
          rollbacks += work.rollbacks;
          adopted += work.adopted;
          anti_messages += work.anti_messages;
        }
      }
    }
  }
  EXPECT_GT(rollbacks, 0u);
  EXPECT_GT(adopted, 0u);
  EXPECT_GT(anti_messages, 0u);
  RecordProperty("rollbacks", std::to_string(rollbacks));
  RecordProperty("adopted", std::to_string(adopted));
  RecordProperty("anti_messages", std::to_string(anti_messages));
}

}  // namespace
}  // namespace soda::kernel
