#include <gtest/gtest.h>

#include <chrono>

#include "kernel/api/execution_times.hpp"
#include "kernel/executors/worker_clock.hpp"
#include "kernel/phold/phold.hpp"
#include "tests/kernel/rank_threads.hpp"
#include "tests/kernel/rough_model.hpp"

namespace soda::kernel {
namespace {

constexpr VirtualTime kEnd{2000, 0};

std::uint8_t one_kind(VirtualTime) { return 0; }

ThreadsOptions accounting(unsigned threads, std::uint64_t seed) {
  ThreadsOptions options{.threads = threads, .window = 8, .scheduling_seed = seed};
  options.recording.kind_of = one_kind;
  options.recording.accounts = true;
  return options;
}

// No worker has less than nothing of anything.
void expect_sound(const TimeAccount& account) {
  EXPECT_GT(account.standing.useful_ns, 0);
  EXPECT_GE(account.standing.sending_ns, 0);
  EXPECT_GE(account.gvt_ns, 0);
  EXPECT_GE(account.rolled_back_ns, 0);
  EXPECT_GE(account.bookkeeping_ns, 0);
  EXPECT_GE(account.waiting_ns, 0);
}

TEST(WorkerAccount, NoTimeOfAThreadIsMissingOrCountedTwice) {
  using Clock = std::chrono::steady_clock;
  for (const unsigned threads : {1u, 2u, 4u}) {
    const auto lps = make_phold(rough_model(threads));
    const Clock::time_point begin = Clock::now();
    const RunResult run = run_threads(lps, kEnd, accounting(threads, 0));
    const std::int64_t wall_ns = std::chrono::nanoseconds(Clock::now() - begin).count();
    ASSERT_TRUE(run.account);
    expect_sound(*run.account);
    // What is outside: building the workers, and adding up what they say.
    EXPECT_LE(run.account->sum_ns(), threads * wall_ns);
    EXPECT_GT(run.account->sum_ns(), threads * wall_ns / 2);
  }
}

TEST(WorkerAccount, WhatIsRolledBackCosts) {
  const RunResult run = run_threads(make_phold(rough_model(7)), kEnd, accounting(3, 11));
  ASSERT_GT(run.counters.rolled_back, 0u);
  ASSERT_TRUE(run.account);
  EXPECT_GT(run.account->rolled_back_ns, 0);
}

TEST(WorkerAccount, RanksAddUp) {
  const RunResult run = RankThreads::run(3, make_phold(rough_model(3)), kEnd, accounting(2, 5));
  ASSERT_TRUE(run.account);
  expect_sound(*run.account);
}

TEST(WorkerAccount, IsKeptOnlyIfAskedFor) {
  EXPECT_FALSE(run_threads(make_phold(rough_model(1)), kEnd, {.threads = 2}).account);
}

TEST(ExecutionTimes, WhatStandsAtTheEndIsWhatWasCommitted) {
  constexpr LpId kLp{4};
  const auto at = [](std::int64_t t) { return VirtualTime{t, 0}; };
  ExecutionTimes times;
  times.executed(kLp, at(1), 10);
  times.executed(kLp, at(2), 200);
  times.executed(kLp, at(3), 3000);
  times.rolled_back(kLp, at(3));
  times.rolled_back(kLp, at(2));
  times.executed(kLp, at(2), 40'000);  // again, and it stands
  times.put_back(kLp, at(3));          // this did not change
  times.executed(kLp, at(4), 500'000);
  times.committed(kLp, at(3));
  EXPECT_EQ(times.committed_ns(), 10 + 40'000 + 3000);
  EXPECT_EQ(times.others_ns(), 200 + 500'000);  // undone, and never committed
}

TEST(ExecutionTimes, AnExecutionThatWasAbsorbedIsNoneOfThem) {
  ExecutionTimes times;
  times.rolled_back(LpId{0}, VirtualTime{5, 0});
  times.put_back(LpId{0}, VirtualTime{5, 0});
  times.committed(LpId{0}, VirtualTime{5, 0});
  EXPECT_EQ(times.committed_ns(), 0);
  EXPECT_EQ(times.others_ns(), 0);
}

TEST(WorkerClock, CountsEachPhaseUntilTheNext) {
  const WorkerClock::Point begin = std::chrono::steady_clock::now();
  WorkerClock clock(true);
  EXPECT_EQ(clock.enter(WorkerPhase::kExecuting), WorkerPhase::kWaiting);
  EXPECT_EQ(clock.enter(WorkerPhase::kGvt), WorkerPhase::kExecuting);
  const WorkerClock::Point end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  clock.end_run(end);
  EXPECT_GE(clock.in(WorkerPhase::kGvt), 1'000'000'000);
  std::int64_t sum_ns = 0;
  for (const auto phase : {WorkerPhase::kWaiting, WorkerPhase::kMessages, WorkerPhase::kUndoing,
                           WorkerPhase::kExecuting, WorkerPhase::kGvt})
    sum_ns += clock.in(phase);
  EXPECT_LE(sum_ns, std::chrono::nanoseconds(end - begin).count());
}

}  // namespace
}  // namespace soda::kernel
