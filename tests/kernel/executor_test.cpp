// What all executors promise, and what the threads executor adds.
#include "kernel/api/executor.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>

#include "kernel/phold/phold.hpp"
#include "tests/kernel/rank_threads.hpp"
#include "tests/kernel/scripted_process.hpp"

namespace soda::kernel {
namespace {

using Times = std::vector<VirtualTime>;
using Lps = std::vector<std::unique_ptr<LogicalProcess>>;

constexpr VirtualTime at(std::int64_t t, std::uint32_t round = 0) { return {t, round}; }

Times every_tick(std::int64_t count) {
  Times times;
  for (std::int64_t t = 0; t < count; ++t) times.push_back(at(t));
  return times;
}

Lps make_lps(std::vector<ScriptedProcess::Script> scripts) {
  Lps lps;
  for (auto& script : scripts) lps.push_back(std::make_unique<ScriptedProcess>(std::move(script)));
  return lps;
}

const ScriptedProcess& scripted(const Lps& lps, std::size_t i) {
  return static_cast<const ScriptedProcess&>(*lps[i]);
}

struct Executor {
  bool sequential = true;
  ThreadsOptions options = {};
  std::uint32_t ranks = 0;  // 0: not distributed
};

RunResult run(const Lps& lps, VirtualTime end, const Executor& executor,
              const ProgressFn& progress = {}) {
  if (executor.sequential) return run_sequential(lps, end, progress);
  if (executor.ranks > 0)
    return RankThreads::run(executor.ranks, lps, end, executor.options, progress);
  return run_threads(lps, end, executor.options, progress);
}

std::vector<Executor> all_executors() {
  std::vector<Executor> executors = {{}};
  for (const unsigned threads : {1u, 2u, 4u})
    for (const std::int64_t window :
         {kWindowByWork, std::int64_t{1}, std::int64_t{4}, std::int64_t{48}})
      for (const std::uint64_t seed : {0, 1, 2, 3})
        executors.push_back({false, {threads, window, seed}});
  for (const std::uint32_t ranks : {1u, 2u, 4u})
    for (const unsigned threads : {1u, 2u})
      for (const std::int64_t window : {kWindowByWork, std::int64_t{48}})
        for (const std::uint64_t seed : {0, 1})
          executors.push_back({false, {threads, window, seed}, ranks});
  return executors;
}

std::string name_of(const Executor& executor) {
  if (executor.sequential) return "sequential";
  const ThreadsOptions& options = executor.options;
  return describe("ranks ", executor.ranks, ", threads ", options.threads, ", window ",
                  options.window, ", seed ", options.scheduling_seed);
}

TEST(Executors, StopExactlyAtTheEnd) {
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    ScriptedProcess::Script script{.future_events = {at(0), at(5, 0), at(5, 1), at(5, 2), at(6)}};
    script.on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
      outbox.send(LpId{1}, {now.t, now.round + 1}, 0, number(1));
    };
    const Lps lps = make_lps({script, {}});
    const RunResult result = run(lps, at(5, 2), executor);
    EXPECT_EQ(scripted(lps, 0).commits, (Times{at(0), at(5, 0), at(5, 1)}));
    EXPECT_EQ(scripted(lps, 1).commits, (Times{at(0, 1), at(5, 1)}));
    EXPECT_EQ(scripted(lps, 0).executions.back(), at(5, 1));
    EXPECT_EQ(result.counters.committed, 5u);
  }
}

TEST(Executors, RunNothingWhenThereIsNothingToDo) {
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    EXPECT_EQ(run({}, at(5), executor).counters.executed, 0u);
    EXPECT_EQ(run(make_lps({{}, {}, {}}), at(5), executor).counters.executed, 0u);
    const Lps at_the_end = make_lps({{.future_events = {at(5)}}});
    EXPECT_EQ(run(at_the_end, at(5), executor).counters.executed, 0u);
  }
}

TEST(Executors, NumberMessagesOfOneIdInTheOrderOfSending) {
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    std::vector<std::string> bags;
    const ScriptedProcess::Script sender{
        .future_events = {at(0), at(1)},
        .on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
          for (const std::uint64_t value : {2, 1})
            outbox.send(LpId{0}, at(9), 3, number(10 * static_cast<std::uint64_t>(now.t) + value));
          outbox.send(LpId{0}, at(9), 2, nullptr);
        }};
    const ScriptedProcess::Script receiver{.on_execute = [&](auto&, VirtualTime, auto bag,
                                                             Outbox&) {
      std::string text;
      for (const MessageView& m : bag)
        text +=
            describe(index_of(m.source), '/', m.kind, '.', m.slot, '=', number_in(m.payload), ' ');
      bags.push_back(text);
    }};
    const Lps lps = make_lps({receiver, sender, sender});
    run(lps, at(100), executor);
    ASSERT_FALSE(bags.empty());
    EXPECT_EQ(bags.back(),
              "1/2.0=0 1/2.1=0 1/3.0=2 1/3.1=1 1/3.2=12 1/3.3=11 "
              "2/2.0=0 2/2.1=0 2/3.0=2 2/3.1=1 2/3.2=12 2/3.3=11 ");
  }
}

// LP 1 must hear from LP 0 at every even tick before it runs at the odd one, else it faults. Which
// it does again and again in an optimistic run, for nothing.
TEST(Executors, FaultThatIsRolledBackIsNotRaised) {
  std::atomic<int> faults = 0;
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    ScriptedProcess::Script teller{.future_events = every_tick(40)};
    teller.on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
      outbox.send(LpId{1}, {now.t, 1}, 0, number(1));
    };
    ScriptedProcess::Script listener;
    for (std::int64_t t = 0; t < 40; ++t) listener.future_events.push_back(at(t, 2));
    listener.on_execute = [&](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
      if (self.state.sum == static_cast<std::uint64_t>(now.t) + 1) return;
      outbox.fault({1, describe("heard ", self.state.sum, " by ", now)});
      ++faults;
    };
    const Lps lps = make_lps({teller, listener});
    const RunResult result = run(lps, at(40), executor);
    EXPECT_FALSE(result.fault) << result.fault->fault.what;
    EXPECT_EQ(result.counters.committed, 120u);
    EXPECT_EQ(scripted(lps, 1).commits.size(), 80u);
  }
  EXPECT_GT(faults, 0) << "no speculative fault happened: the test proves nothing";
}

TEST(Executors, RealFaultIsTheSameEverywhereAndHoldsBackWhatIsNotBeforeIt) {
  std::uint64_t rollbacks = 0;
  int with_fault = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const PholdOptions model{.lps = 8,
                             .remote_per_mille = 600,
                             .zero_delay_rounds = 1,
                             .state_carrying_per_mille = 400,
                             .fault_divisor = 60,
                             .seed = seed};
    const Lps oracle_lps = make_phold(model);
    const RunResult oracle = run_sequential(oracle_lps, at(60));
    with_fault += oracle.fault.has_value();
    for (const Executor& executor : all_executors()) {
      SCOPED_TRACE(name_of(executor));
      const Lps lps = make_phold(model);
      const RunResult result = run(lps, at(60), executor);
      ASSERT_EQ(result.fault.has_value(), oracle.fault.has_value()) << "seed " << seed;
      if (oracle.fault) {
        EXPECT_EQ(result.fault->when, oracle.fault->when);
        EXPECT_EQ(result.fault->lp, oracle.fault->lp);
        EXPECT_EQ(result.fault->fault.what, oracle.fault->fault.what);
      }
      ASSERT_EQ(phold_digest(lps), phold_digest(oracle_lps)) << "seed " << seed;
      EXPECT_EQ(result.counters.committed, oracle.counters.committed);
      rollbacks += result.counters.rollbacks;
    }
  }
  EXPECT_GE(with_fault, 6);
  EXPECT_GT(rollbacks, 0u);
}

// Whoever of the LPs met it: of one subject, the lowest LP. Its first fault counts.
TEST(Executors, LowestSubjectOfTheFaultTimeIsReportedAndNothingOfThatTimeCommitted) {
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    const ScriptedProcess::Script sound{.future_events = every_tick(9)};
    const auto failing = [&](std::uint64_t subject) {
      ScriptedProcess::Script script = sound;
      script.on_execute = [subject](auto&, VirtualTime now, auto, Outbox& outbox) {
        if (now.t == 4) outbox.fault({subject, "first"});
        if (now.t == 4) outbox.fault({1, "second"});
      };
      return script;
    };
    const Lps lps = make_lps({sound, failing(9), failing(5), failing(5)});
    const RunResult result = run(lps, at(9), executor);
    ASSERT_TRUE(result.fault);
    EXPECT_EQ(result.fault->when, at(4));
    EXPECT_EQ(result.fault->lp, LpId{2});
    EXPECT_EQ(result.fault->fault.subject, 5u);
    EXPECT_EQ(result.fault->fault.what, "first");
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(scripted(lps, i).commits, every_tick(4));
  }
}

// LP 0 restarts at multiples of 10 only; the others send it what makes it restart.
TEST(Executors, LpWithFewRestartPointsCommitsLikeTheSequentialRun) {
  const auto network = [] {
    ScriptedProcess::Script rare{.future_events = every_tick(60), .mark_every_t = 10};
    rare.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
      outbox.send(LpId{1 + static_cast<std::uint32_t>(now.t % 2)}, at(now.t + 1), 0,
                  number(self.state.sum % 5));
    };
    ScriptedProcess::Script frequent{.future_events = every_tick(60)};
    frequent.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
      if (self.state.sum % 3 != 1) outbox.send(LpId{0}, {now.t, 1}, 0, number(self.state.sum + 1));
    };
    return make_lps({rare, frequent, frequent});
  };
  const Lps oracle = network();
  run_sequential(oracle, at(60));
  std::uint64_t rollbacks = 0;
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    const Lps lps = network();
    rollbacks += run(lps, at(60), executor).counters.rollbacks;
    for (std::size_t i = 0; i < lps.size(); ++i) {
      EXPECT_EQ(scripted(lps, i).commits, scripted(oracle, i).commits);
      EXPECT_EQ(scripted(lps, i).state.sum, scripted(oracle, i).state.sum);
    }
  }
  EXPECT_GT(rollbacks, 0u);
}

// LP 0 waits at every tick for a message that LP 1 sends it at every third one only: elsewhere GVT
// must come up to it, and no further.
TEST(Executors, WhoWaitsForWhatNeverComesHoldsBackGvtUntilItIsReached) {
  const auto network = [] {
    ScriptedProcess::Script waiting{.future_events = every_tick(60), .waits_for_a_message = true};
    waiting.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
      outbox.send(LpId{1}, {now.t, 1}, 0, number(self.state.sum % 7));
    };
    ScriptedProcess::Script busy{.future_events = every_tick(60)};
    busy.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
      if (now.t % 3 == 2) outbox.send(LpId{0}, at(now.t + 1), 0, number(self.state.sum + 1));
    };
    return make_lps({waiting, busy});
  };
  const Lps oracle = network();
  run_sequential(oracle, at(60));
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    const Lps lps = network();
    run(lps, at(60), executor);
    for (std::size_t i = 0; i < lps.size(); ++i) {
      EXPECT_EQ(scripted(lps, i).commits, scripted(oracle, i).commits);
      EXPECT_EQ(scripted(lps, i).state.sum, scripted(oracle, i).state.sum);
    }
  }
}

TEST(Executors, ProgressRisesToTheEndAndComesAfterTheCommits) {
  for (const Executor& executor : all_executors()) {
    SCOPED_TRACE(name_of(executor));
    std::vector<ScriptedProcess::Script> scripts(5, {.future_events = every_tick(100)});
    const Lps lps = make_lps(scripts);
    VirtualTime last = kBeginning;
    const ProgressFn progress = [&](VirtualTime gvt, const Counters& so_far) {
      EXPECT_GE(gvt, last);
      const bool knows_all = executor.ranks < 2;
      EXPECT_TRUE(!knows_all || so_far.committed >= 5 * static_cast<std::uint64_t>(gvt.t));
      last = gvt;
    };
    run(lps, at(100), executor, progress);
    EXPECT_EQ(last, at(100));
  }
}

TEST(ThreadsExecutor, MoreThreadsThanLps) {
  const Lps lps = make_lps({{.future_events = every_tick(10)}, {.future_events = every_tick(10)}});
  EXPECT_EQ(run_threads(lps, at(10), {.threads = 9, .window = 2}).counters.committed, 20u);
}

TEST(ThreadsExecutor, ThrowsInTheCallerWhatLeavesAHandler) {
  for (const unsigned threads : {1u, 2u, 4u}) {
    std::vector<ScriptedProcess::Script> scripts(4, {.future_events = every_tick(1000)});
    scripts[2].on_execute = [](auto&, VirtualTime now, auto, Outbox&) {
      if (now.t == 20) throw std::runtime_error("out of paper");
    };
    const Lps lps = make_lps(scripts);
    try {
      run_threads(lps, at(1000), {.threads = threads, .window = 8});
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "out of paper");
    }
  }
}

TEST(ThreadsExecutor, OneThreadWithASeedIsReproducibleToTheLastRollback) {
  const PholdOptions model{.lps = 10, .start_events_per_lp = 2, .zero_delay_rounds = 1};
  const ThreadsOptions options{.threads = 1, .window = 16, .scheduling_seed = 5};
  const Lps first_lps = make_phold(model);
  const Counters first = run_threads(first_lps, at(60), options).counters;
  const Lps again_lps = make_phold(model);
  const Counters again = run_threads(again_lps, at(60), options).counters;
  EXPECT_GT(first.rollbacks, 0u);
  EXPECT_EQ(first.executed, again.executed);
  EXPECT_EQ(first.rollbacks, again.rollbacks);
  EXPECT_EQ(first.anti_messages, again.anti_messages);
  EXPECT_EQ(first.gvt_rounds, again.gvt_rounds);
  const Lps other_lps = make_phold(model);
  ThreadsOptions other_seed = options;
  other_seed.scheduling_seed = 6;
  EXPECT_NE(first.executed, run_threads(other_lps, at(60), other_seed).counters.executed);
}

// The window is the bound: an LP holds no checkpoint behind the one that GVT needs.
TEST(ThreadsExecutor, CheckpointsAreBoundedByTheWindowHoweverLongTheRun) {
  const PholdOptions model{
      .lps = 8, .start_events_per_lp = 4, .remote_per_mille = 500, .zero_delay_rounds = 2};
  for (const std::int64_t window : {1, 6}) {
    for (const std::uint64_t seed : {0, 1}) {
      const Lps lps = make_phold(model);
      const ThreadsOptions options{.threads = 2, .window = window, .scheduling_seed = seed};
      const RunResult result = run_threads(lps, at(3000), options);
      EXPECT_GT(result.counters.committed, 10000u);
      const auto rounds_per_tick = static_cast<std::size_t>(model.zero_delay_rounds) + 1;
      EXPECT_LE(phold_checkpoints(lps), static_cast<std::size_t>(window) * rounds_per_tick + 1);
    }
  }
}

TEST(ExecutorsDeathTest, SendIntoThePastAborts) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  ScriptedProcess::Script script{.future_events = {at(3, 4)}};
  script.on_execute = [](auto&, VirtualTime, auto, Outbox& outbox) {
    outbox.send(LpId{1}, at(3, 3), 8, nullptr);
  };
  const char* const message = "LP 0 executing \\(3, 4\\) sends kind 8 to LP 1 at \\(3, 3\\)";
  EXPECT_DEATH(run(make_lps({script, {}}), at(9), {}), message);
  EXPECT_DEATH(run(make_lps({script, {}}), at(9), {false, {.threads = 2}}), message);
}

}  // namespace
}  // namespace soda::kernel
