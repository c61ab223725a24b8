// Where the time of the virtual cluster's processors goes: nothing is left over, nothing counts
// twice.
#include <gtest/gtest.h>

#include "kernel/api/time_account.hpp"
#include "kernel/phold/phold.hpp"
#include "kernel/virtual_cluster/adversary.hpp"
#include "kernel/virtual_cluster/processor_clock.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "tests/kernel/rough_model.hpp"
#include "tests/kernel/scripted_process.hpp"

namespace soda::kernel {
namespace {

using Lps = std::vector<std::unique_ptr<LogicalProcess>>;

constexpr VirtualTime kEnd{30, 0};

void expect_closed(const VirtualReport& report) {
  const TimeAccount& account = report.account;
  EXPECT_EQ(account.sum_ns(), report.processors * report.makespan_ns);
  EXPECT_GE(account.waiting_ns, 0);
  EXPECT_GE(account.gvt_ns, 0);
  EXPECT_GE(account.rolled_back_ns, 0);
}

// Each LP's executions cost other parts.
ExecutionCost cost_by_lp(LpId lp) {
  const auto of = static_cast<std::int64_t>(index_of(lp));
  return {.useful_ns = 400 + 7 * of,
          .replicated_ns = 31 * of,
          .division_ns = 100,
          .checkpoints_ns = 60 + of,
          .sending_ns = 3 * of};
}

VirtualOptions costly(unsigned processors, std::int64_t latency_ns) {
  return {.processors = processors,
          .window = 8,
          .cost = cost_by_lp,
          .gvt_cost_ns = 450,
          .commit_cost_ns = 23,
          .latency_ns = latency_ns,
          .jitter_ns = 500,
          .gvt_interval_ns = 3000};
}

TEST(VirtualAccount, ClosesToTheNanosecondForEveryClusterAndPolicy) {
  std::int64_t rolled_back_ns = 0, waiting_ns = 0, gvt_ns = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const unsigned processors : {1u, 3u, 12u}) {
      for (const std::int64_t latency_ns : {0, 700, 30'000}) {
        for (const auto policy : {Synchronisation::kOptimistic, Synchronisation::kLockstep}) {
          VirtualOptions options = costly(processors, latency_ns);
          options.synchronisation = policy;
          options.seed = seed;
          const VirtualResult found = run_virtual(make_phold(rough_model(seed)), kEnd, options);
          expect_closed(found.report);
          rolled_back_ns += found.report.account.rolled_back_ns;
          waiting_ns += found.report.account.waiting_ns;
          gvt_ns += found.report.account.gvt_ns;
          if (policy == Synchronisation::kLockstep) {
            EXPECT_EQ(found.report.account.rolled_back_ns, 0);
          }
        }
      }
    }
  }
  EXPECT_GT(rolled_back_ns, 0);
  EXPECT_GT(waiting_ns, 0);
  EXPECT_GT(gvt_ns, 0);
}

// What stands is what a run without rollbacks executes, whatever was undone meanwhile.
TEST(VirtualAccount, WhatStandsIsWhatLockstepExecutes) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    VirtualOptions options = costly(5, 2000);
    const VirtualReport ahead = run_virtual(make_phold(rough_model(seed)), kEnd, options).report;
    options.synchronisation = Synchronisation::kLockstep;
    const VirtualReport lockstep = run_virtual(make_phold(rough_model(seed)), kEnd, options).report;
    EXPECT_GT(ahead.account.rolled_back_ns, 0);
    EXPECT_EQ(ahead.account.standing.useful_ns, lockstep.account.standing.useful_ns);
    EXPECT_EQ(ahead.account.standing.checkpoints_ns, lockstep.account.standing.checkpoints_ns);
    EXPECT_EQ(ahead.account.standing.sum_ns(), lockstep.account.standing.sum_ns());
  }
}

TEST(VirtualAccount, ClosesWithStallsAndUndoneExecutions) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Adversary adversary(draw_adversary(seed, 12, 1000));
    VirtualOptions options = costly(4, 1000);
    options.adversary = &adversary;
    expect_closed(run_virtual(make_phold(rough_model(seed)), kEnd, options).report);
  }
}

// Other processors are busy, or have executed what nobody commits, when the run ends.
TEST(VirtualAccount, ClosesWhereARunIsStopped) {
  StopRequest stop{0};
  VirtualOptions options = costly(5, 700);
  options.stop = &stop;
  const VirtualResult found = run_virtual(make_phold(rough_model(2)), kEnd, options,
                                          [&stop](VirtualTime gvt, const Counters&) {
                                            if (gvt.t >= 10) stop = 1;
                                          });
  ASSERT_EQ(found.run.stopped, 1u);
  expect_closed(found.report);
  EXPECT_GT(found.report.account.rolled_back_ns, 0);
}

TEST(VirtualAccount, GvtDelaysOnlyWhoHasSomethingToDo) {
  const auto run = [](std::int64_t gvt_cost_ns) {
    VirtualOptions options = costly(3, 5000);
    options.gvt_cost_ns = gvt_cost_ns;
    options.commit_cost_ns = 0;
    return run_virtual(make_phold(rough_model(4)), kEnd, options).report;
  };
  const VirtualReport free = run(0), charged = run(900);
  EXPECT_EQ(free.account.gvt_ns, 0);
  EXPECT_GT(charged.account.gvt_ns, 0);
  EXPECT_LT(charged.makespan_ns - free.makespan_ns, charged.account.gvt_ns);
}

TEST(ProcessorClock, CountsWhatComesBeforeTheEndOfTheRun) {
  ProcessorClock clock;
  clock.execute(100, 50, 0);  // waits until 100
  EXPECT_EQ(clock.now_ns(), 150);
  clock.complete();
  clock.take_part_in_gvt(170, 30, false);
  EXPECT_EQ(clock.now_ns(), 200);
  clock.execute(180, 40, 0);  // GVT lasts until 200
  EXPECT_EQ(clock.now_ns(), 240);
  EXPECT_EQ(clock.end_run(225), 15);
  EXPECT_EQ(clock.waiting_ns(), 100 + 20);
  EXPECT_EQ(clock.gvt_ns(), 30);
}

TEST(ProcessorClock, WhoExecutesTakesPartInGvtAfterwards) {
  ProcessorClock clock;
  clock.execute(0, 100, 0);
  clock.take_part_in_gvt(40, 7, true);
  EXPECT_EQ(clock.now_ns(), 100);
  clock.complete();
  clock.execute(100, 10, 0);
  EXPECT_EQ(clock.now_ns(), 117);
  clock.complete();
  EXPECT_EQ(clock.end_run(117), 0);
  EXPECT_EQ(clock.gvt_ns(), 7);
  EXPECT_EQ(clock.waiting_ns(), 0);
}

}  // namespace
}  // namespace soda::kernel
