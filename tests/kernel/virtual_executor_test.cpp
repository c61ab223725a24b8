// The virtual cluster: what it commits, that it repeats itself, and what its clock says, by hand.
#include "kernel/virtual_cluster/virtual_executor.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "kernel/api/checkers.hpp"
#include "kernel/api/hash_mix.hpp"
#include "kernel/phold/phold.hpp"
#include "tests/kernel/rough_model.hpp"
#include "tests/kernel/scripted_process.hpp"

namespace soda::kernel {
namespace {

using Lps = std::vector<std::unique_ptr<LogicalProcess>>;

constexpr VirtualTime kEnd{30, 0};

TEST(VirtualExecutor, CommitsTheSequentialDigestForEveryClusterAndPolicy) {
  std::uint64_t rollbacks = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Lps oracle = make_phold(rough_model(seed));
    const RunResult expected = run_sequential(oracle, kEnd);
    for (const unsigned processors : {1u, 3u, 12u}) {
      for (const std::int64_t latency_ns : {0, 700, 30'000}) {
        for (const auto policy : {Synchronisation::kOptimistic, Synchronisation::kLockstep}) {
          const Lps lps = make_phold(rough_model(seed));
          const VirtualResult found = run_virtual(lps, kEnd,
                                                  {.processors = processors,
                                                   .window = 8,
                                                   .synchronisation = policy,
                                                   .seed = seed,
                                                   .latency_ns = latency_ns,
                                                   .jitter_ns = 500,
                                                   .gvt_interval_ns = 5000});
          ASSERT_EQ(phold_digest(lps), phold_digest(oracle)) << "seed " << seed;
          ASSERT_EQ(found.run.counters.committed, expected.counters.committed);
          ASSERT_EQ(found.report.account.standing.sum_ns(),
                    1000 * static_cast<std::int64_t>(expected.counters.committed));
          if (policy == Synchronisation::kLockstep)
            ASSERT_EQ(found.run.counters.rollbacks, 0u);
          else
            rollbacks += found.run.counters.rollbacks;
        }
      }
    }
  }
  EXPECT_GT(rollbacks, 1000u);
}

TEST(VirtualExecutor, OneSeedIsOneExecutionAndAnotherSeedAnother) {
  std::set<std::uint64_t> executions;
  for (const std::uint64_t seed : {1, 2, 3, 1, 2, 3}) {
    const Lps lps = make_phold(rough_model(1));
    executions.insert(
        run_virtual(lps, kEnd, {.processors = 4, .window = 8, .seed = seed, .jitter_ns = 5000})
            .report.execution_digest);
  }
  EXPECT_EQ(executions.size(), 3u);
}

// LP 0 runs at (0, 0) and sends 952 bytes (1000 with the header) to LP 1 for (1, 0).
Lps one_message() {
  ScriptedProcess::Script sender{.future_events = {{0, 0}}};
  sender.on_execute = [](ScriptedProcess&, VirtualTime, auto, Outbox& outbox) {
    outbox.send(LpId{1}, {1, 0}, 0, Payload(Bytes(952)));
  };
  Lps lps;
  lps.push_back(std::make_unique<ScriptedProcess>(sender));
  lps.push_back(std::make_unique<ScriptedProcess>(ScriptedProcess::Script{}));
  return lps;
}

TEST(VirtualExecutor, TheClockAddsCostTransferLatencyAndCost) {
  const VirtualOptions options{.processors = 2,
                               .window = 10,
                               .bag_cost_ns = 300,
                               .latency_ns = 7000,
                               .bytes_per_s = 100'000'000,
                               .gvt_interval_ns = 50,
                               .gvt_delay_ns = 10};
  const VirtualReport report = run_virtual(one_message(), {5, 0}, options).report;
  // The first GVT opens the window at 10 ns. 1000 bytes at 100 MB/s take 10 us.
  EXPECT_EQ(report.makespan_ns, 10 + 300 + 10'000 + 7000 + 300);
  EXPECT_EQ(report.account.standing.sum_ns(), 600);
  EXPECT_EQ(report.account.rolled_back_ns, 0);
  EXPECT_EQ(report.remote_messages, 1u);
  EXPECT_EQ(report.remote_bytes, 1000u);
}

TEST(VirtualExecutor, LockstepPaysForABarrierWhereSomethingIsSentOrTimePasses) {
  const VirtualOptions options{.processors = 2,
                               .synchronisation = Synchronisation::kLockstep,
                               .bag_cost_ns = 300,
                               .latency_ns = 7000,
                               .gvt_delay_ns = 10};
  const VirtualReport report = run_virtual(one_message(), {5, 0}, options).report;
  EXPECT_EQ(report.barriers, 2u);  // after (0, 0), and at the end
  EXPECT_EQ(report.makespan_ns, (300 + 7000 + 10) + (300 + 10));
}

// Otherwise a link that is slower than what rollbacks send falls behind without limit, and each
// correction comes later than the one before.
TEST(VirtualExecutor, OnASlowLinkVersionsOfAMessageDoNotPileUp) {
  const Lps oracle = make_phold(rough_model(3));
  const RunResult expected = run_sequential(oracle, kEnd);
  const Lps lps = make_phold(rough_model(3));
  ConservationChecker conservation;
  const VirtualResult found = run_virtual(lps, kEnd,
                                          {.processors = 12,
                                           .window = 10,
                                           .latency_ns = 0,
                                           .bytes_per_s = 20'000'000,
                                           .gvt_interval_ns = 3000,
                                           .max_actions = 100'000,
                                           .observer = &conservation});
  EXPECT_EQ(phold_digest(lps), phold_digest(oracle));
  EXPECT_LT(found.report.remote_messages,
            found.run.counters.messages + found.run.counters.anti_messages);
  EXPECT_LT(found.run.counters.executed, 30 * expected.counters.executed);
}

TEST(VirtualExecutor, OneProcessorIsAlwaysBusyAndSendsNothing) {
  const Lps lps = make_phold(rough_model(3));
  const VirtualResult result =
      run_virtual(lps, kEnd, {.window = 1000, .gvt_interval_ns = 1000, .gvt_delay_ns = 0});
  EXPECT_EQ(result.report.makespan_ns, result.report.account.standing.useful_ns);
  EXPECT_EQ(result.report.remote_messages, 0u);
  EXPECT_EQ(result.run.counters.rollbacks, 0u);
}

TEST(VirtualExecutor, TheWindowBoundsHistory) {
  const auto most_history = [](std::int64_t window, std::int64_t end) {
    const Lps lps = make_phold(rough_model(2));
    return run_virtual(lps, {end, 0}, {.processors = 12, .window = window, .gvt_interval_ns = 2000})
        .report.most_history;
  };
  const std::uint64_t small = most_history(2, 400);
  EXPECT_LT(small, most_history(64, 400));
  EXPECT_LE(most_history(2, 1600), small + small / 2) << "history grows with the length of a run";
}

TEST(VirtualExecutor, WithoutAWindowTheExecutionsThatGvtHasNotPassedAreBounded) {
  constexpr unsigned kProcessors = 4;
  const std::uint64_t lps_of_each = rough_model(2).lps / kProcessors;
  const auto find = [&](std::int64_t window) {
    const Lps lps = make_phold(rough_model(2));
    return run_virtual(
        lps, {1600, 0},
        {.processors = kProcessors, .window = window, .gvt_interval_ns = 10'000'000});
  };
  const VirtualResult unbounded = find(std::numeric_limits<std::int64_t>::max());
  const VirtualResult bounded = find(VirtualOptions{}.window);
  EXPECT_EQ(bounded.run.counters.committed, unbounded.run.counters.committed);
  EXPECT_GT(bounded.run.counters.lead_max, 10u);
  const std::uint64_t bound = kProcessors * (most_uncommitted(lps_of_each) + lps_of_each);
  EXPECT_LE(bounded.report.most_history, bound);
  EXPECT_GT(unbounded.report.most_history, bound) << "nothing had to be bounded";
}

TEST(VirtualExecutor, ARunThatFaultsEndsWithTheSequentialRunsFault) {
  PholdOptions model = rough_model(5);
  model.fault_divisor = 150;
  const Lps oracle = make_phold(model);
  const RunResult expected = run_sequential(oracle, {200, 0});
  ASSERT_TRUE(expected.fault);
  const Lps lps = make_phold(model);
  const RunResult found =
      run_virtual(lps, {200, 0}, {.processors = 5, .window = 20, .gvt_interval_ns = 3000}).run;
  ASSERT_TRUE(found.fault);
  EXPECT_EQ(found.fault->when, expected.fault->when);
  EXPECT_EQ(found.fault->lp, expected.fault->lp);
  EXPECT_EQ(phold_digest(lps), phold_digest(oracle));
}

// LP 0 saves its state every tenth tick. A message for tick 17 that comes late undoes what it has
// executed since tick 10, and while its processor is busy with LP 1 at tick 16, round 5, GVT passes
// the fault of LP 4 at tick 16.
TEST(VirtualExecutor, WhatIsUndoneBehindTheFaultThatEndsTheRunIsCommittedAllTheSame) {
  const auto ticks = [](std::int64_t count) {
    std::vector<VirtualTime> times;
    for (std::int64_t t = 0; t < count; ++t) times.push_back({t, 0});
    return times;
  };
  ScriptedProcess::Script late{.future_events = {{10, 0}}};
  late.on_execute = [](auto&, VirtualTime, auto, Outbox& outbox) {
    outbox.send(LpId{0}, {17, 0}, 0, nullptr);
    outbox.send(LpId{1}, {16, 5}, 0, nullptr);
  };
  ScriptedProcess::Script failing{.future_events = {{16, 0}}};
  failing.on_execute = [](auto&, VirtualTime, auto, Outbox& outbox) { outbox.fault({1, ""}); };
  Lps lps;
  for (const ScriptedProcess::Script& script :
       {ScriptedProcess::Script{.future_events = ticks(30), .mark_every_t = 10},
        {},
        late,
        {},
        failing,
        {}})
    lps.push_back(std::make_unique<ScriptedProcess>(script));
  const RunResult result =
      run_virtual(
          lps, {30, 0},
          {.processors = 3,  // of two LPs each
           .window = 10,
           .cost =
               [](LpId lp) { return ExecutionCost{.useful_ns = lp == LpId{2} ? 100'000 : 1000}; },
           .latency_ns = 0,
           .gvt_interval_ns = 700,
           .gvt_delay_ns = 0})
          .run;
  ASSERT_TRUE(result.fault);
  EXPECT_EQ(result.fault->when, (VirtualTime{16, 0}));
  EXPECT_EQ(result.counters.rollbacks, 1u);
  EXPECT_EQ(static_cast<const ScriptedProcess&>(*lps[0]).commits, ticks(16));
  EXPECT_EQ(static_cast<const ScriptedProcess&>(*lps[0]).executions.back(), (VirtualTime{15, 0}))
      << "nothing was left undone when GVT passed the fault: the test proves nothing";
}

TEST(VirtualExecutor, ARunWithTooManyActionsIsGivenUp) {
  const Lps lps = make_phold(rough_model(1));
  EXPECT_THROW(run_virtual(lps, kEnd, {.window = 4, .max_actions = 20}), Violation);
}

TEST(VirtualExecutor, PurityOfAPureModelHoldsUnderRollbacks) {
  const Lps oracle = make_phold(rough_model(6));
  run_sequential(oracle, kEnd);
  const Lps lps = make_phold(rough_model(6));
  const RunResult result =
      run_virtual(lps, kEnd, {.processors = 6, .window = 20, .check_purity = true}).run;
  EXPECT_EQ(phold_digest(lps), phold_digest(oracle));
  EXPECT_GT(result.counters.rollbacks, 0u);
}

TEST(VirtualExecutorDeathTest, AHandlerThatSendsSomethingElseTheSecondTimeIsNoticed) {
  ScriptedProcess::Script script{.future_events = {{0, 0}}};
  script.on_execute = [](ScriptedProcess& self, VirtualTime, auto, Outbox& outbox) {
    outbox.send(LpId{0}, {1, 0}, 0, number(self.executions.size()));
  };
  Lps lps;
  lps.push_back(std::make_unique<ScriptedProcess>(script));
  EXPECT_DEATH(run_virtual(lps, {3, 0}, {.window = 4, .check_purity = true}),
               "LP 0 executing \\(0, 0\\) again .* is not a pure function");
}

// A state that depends on how often it was computed; what is sent does not.
class Impure final : public LogicalProcess {
 public:
  VirtualTime next_time() const override { return done_ ? kNever : VirtualTime{0, 0}; }
  void execute(VirtualTime, std::span<const MessageView>, Outbox&) override {
    done_ = true;
    ++executions_;
  }
  void mark(VirtualTime) override {}
  VirtualTime rewind(VirtualTime) override {
    done_ = false;
    return kBeginning;
  }
  VirtualTime forget(VirtualTime) override { return kBeginning; }
  void commit(VirtualTime) override {}
  std::uint64_t digest() const override { return executions_; }

 private:
  bool done_ = false;
  std::uint64_t executions_ = 0;
};

TEST(VirtualExecutorDeathTest, AHandlerThatLeavesAnotherStateTheSecondTimeIsNoticed) {
  Lps lps;
  lps.push_back(std::make_unique<Impure>());
  EXPECT_DEATH(run_virtual(lps, {3, 0}, {.window = 4, .check_purity = true}),
               "gets state 2 .* is not a pure function");
}

TEST(Adversary, ARecordedListOfDecisionsRepeatsTheExecution) {
  std::uint64_t decisions = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const AdversaryPlan plan = draw_adversary(seed, 12, 1000);
    const auto execute = [&](Adversary adversary) {
      const Lps lps = make_phold(rough_model(seed));
      const VirtualReport report =
          run_virtual(
              lps, kEnd,
              {.processors = 4, .window = 8, .gvt_interval_ns = 5000, .adversary = &adversary})
              .report;
      return std::pair(report.execution_digest, adversary.decisions());
    };
    const auto [drawn, list] = execute(Adversary(plan));
    EXPECT_EQ(execute(Adversary(plan, list)).first, drawn) << "seed " << seed;
    const Adversary undisturbed(plan, std::vector<Decision>{});
    EXPECT_EQ(execute(undisturbed).first == drawn, list.empty()) << "seed " << seed;
    decisions += list.size();
  }
  EXPECT_GT(decisions, 1000u);
}

TEST(Threads, LockstepNeverRollsBackAndCommitsTheSequentialDigest) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Lps oracle = make_phold(rough_model(seed));
    const RunResult expected = run_sequential(oracle, kEnd);
    for (const unsigned threads : {1u, 2u, 4u}) {
      for (const std::uint64_t scheduling_seed : {std::uint64_t{0}, seed}) {
        const Lps lps = make_phold(rough_model(seed));
        const RunResult result = run_threads(lps, kEnd,
                                             {.threads = threads,
                                              .window = 8,
                                              .scheduling_seed = scheduling_seed,
                                              .synchronisation = Synchronisation::kLockstep});
        EXPECT_EQ(phold_digest(lps), phold_digest(oracle));
        EXPECT_EQ(result.counters.committed, expected.counters.committed);
        EXPECT_EQ(result.counters.rollbacks, 0u);
        EXPECT_EQ(result.counters.anti_messages, 0u);
        EXPECT_EQ(result.counters.lead_max, 0u);
      }
    }
  }
}

}  // namespace
}  // namespace soda::kernel
