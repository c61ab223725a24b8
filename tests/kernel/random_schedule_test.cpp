// Time Warp processes under an omniscient scheduler (omniscient_schedule.hpp) in orders drawn from
// a seed. every_order_test.cpp has all orders of small networks.
#include <gtest/gtest.h>

#include "kernel/api/executor.hpp"
#include "kernel/api/hash_mix.hpp"
#include "kernel/phold/phold.hpp"
#include "tests/kernel/omniscient_schedule.hpp"

namespace soda::kernel {
namespace {

// Returns how many executions were of a message as it arrived.
std::uint64_t check_orders(Arrival arrival) {
  const VirtualTime end{16, 0};
  std::uint64_t in_order = 0;
  std::uint64_t rollbacks = 0;
  std::uint64_t anti_messages = 0;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    SplitMix64 random(seed);
    const PholdOptions model{
        .lps = 1 + static_cast<std::uint32_t>(random.below(6)),
        .start_events_per_lp = 1 + static_cast<std::uint32_t>(random.below(3)),
        .remote_per_mille = static_cast<std::uint32_t>(random.below(1001)),
        .mean_delay = 1 + static_cast<std::uint32_t>(random.below(4)),
        .zero_delay_rounds = static_cast<std::uint32_t>(random.below(3)),
        .state_carrying_per_mille = static_cast<std::uint32_t>(random.below(500)),
        .doubled_per_mille = static_cast<std::uint32_t>(random.below(300)),
        .seed = seed};
    const Lps oracle = make_phold(model);
    const RunResult expected = run_sequential(oracle, end);
    const Lps lps = make_phold(model);
    Schedule schedule(lps, end, Collect::kWhenChosen, arrival);
    schedule.run([&](std::size_t count) { return random.below(count); });
    EXPECT_EQ(phold_digest(lps), phold_digest(oracle)) << "seed " << seed;
    EXPECT_EQ(schedule.counters().committed, expected.counters.committed) << "seed " << seed;
    rollbacks += schedule.counters().rollbacks;
    anti_messages += schedule.counters().anti_messages;
    in_order += schedule.executed_in_order();
  }
  EXPECT_GT(rollbacks, 1000u);
  EXPECT_GT(anti_messages, 1000u);
  return in_order;
}

TEST(RandomSchedule, AnyOrderOfActionsCommitsTheSequentialDigest) {
  EXPECT_EQ(check_orders(Arrival::kWaits), 0u);
}

TEST(RandomSchedule, WhatIsExecutedAsItArrivesIsUndoneLikeAnythingElse) {
  EXPECT_GT(check_orders(Arrival::kIsExecutedIfInOrder), 1000u);
}

}  // namespace
}  // namespace soda::kernel
