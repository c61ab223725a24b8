// The order-sensitive PHOLD under both executors: the same committed digest, whatever the schedule.
#include "kernel/phold/phold.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/phold/standard_phold.hpp"
#include "tests/kernel/rough_model.hpp"

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

TEST(StandardPhold, EveryExecutorCommitsTheSequentialEventsAndDigest) {
  std::uint64_t rollbacks = 0;
  std::vector<std::uint64_t> digests;
  for (const bool order_sensitive : {false, true}) {
    for (const std::uint32_t zero_delay_rounds : {0u, 2u}) {
      for (const double least_delay : {0.0, 0.1, 1.0}) {
        const StandardPholdOptions model{.lps = 40,
                                         .start_events_per_lp = 3,
                                         .remote = 0.5,
                                         .least_delay = least_delay,
                                         .zero_delay_rounds = zero_delay_rounds,
                                         .order_sensitive = order_sensitive,
                                         .seed = 11};
        const VirtualTime end{30 * kTicksPerUnit, 0};
        const auto oracle = make_standard_phold(model);
        run_sequential(oracle, end);
        const StandardPholdResult expected = standard_phold_result(oracle);
        EXPECT_GT(expected.events, 3000u);
        digests.push_back(expected.digest);
        for (const unsigned threads : {1u, 2u, 4u}) {
          for (const std::uint64_t scheduling_seed : {0, 7}) {
            const auto lps = make_standard_phold(model);
            const RunResult run = run_threads(lps, end,
                                              {.threads = threads,
                                               .window = 4 * kTicksPerUnit,
                                               .scheduling_seed = scheduling_seed});
            const StandardPholdResult result = standard_phold_result(lps);
            ASSERT_EQ(result.digest, expected.digest) << "threads " << threads;
            ASSERT_EQ(result.events, expected.events) << "threads " << threads;
            rollbacks += run.counters.rollbacks;
          }
        }
      }
    }
  }
  EXPECT_GT(rollbacks, 100u);
  std::sort(digests.begin(), digests.end());
  EXPECT_EQ(std::unique(digests.begin(), digests.end()), digests.end()) << "a blind digest";
}

}  // namespace
}  // namespace soda::kernel
