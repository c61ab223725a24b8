// What goes wrong while a model runs: exceptions of handlers, threads that the system refuses, and
// times that no executor can execute.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <new>
#include <stdexcept>
#include <string>

#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "tests/kernel/rank_threads.hpp"
#include "tests/kernel/scripted_process.hpp"
#include "tests/kernel/time_warp_bench.hpp"

namespace soda::kernel {
namespace {

using namespace bench;
using Lps = std::vector<std::unique_ptr<LogicalProcess>>;

Lps make_lps(std::vector<ScriptedProcess::Script> scripts) {
  Lps lps;
  for (auto& script : scripts) lps.push_back(std::make_unique<ScriptedProcess>(std::move(script)));
  return lps;
}

const ScriptedProcess& scripted(const Lps& lps, std::size_t i) {
  return static_cast<const ScriptedProcess&>(*lps[i]);
}

Times every_tick(std::int64_t count) {
  Times times;
  for (std::int64_t t = 0; t < count; ++t) times.push_back(at(t));
  return times;
}

using Run = std::function<RunResult(const Lps& lps, VirtualTime end)>;

std::vector<std::pair<std::string, Run>> all_executors() {
  std::vector<std::pair<std::string, Run>> all;
  all.emplace_back("sequential",
                   [](const Lps& lps, VirtualTime end) { return run_sequential(lps, end); });
  for (const unsigned threads : {1u, 2u, 4u})
    for (const std::uint64_t seed : {0, 1, 2, 3})
      all.emplace_back(describe("threads ", threads, ", seed ", seed), [=](const Lps& lps,
                                                                           VirtualTime end) {
        return run_threads(lps, end, {.threads = threads, .window = 8, .scheduling_seed = seed});
      });
  for (const Synchronisation policy : {Synchronisation::kOptimistic, Synchronisation::kLockstep})
    all.emplace_back(describe("virtual, policy ", static_cast<int>(policy)), [=](const Lps& lps,
                                                                                 VirtualTime end) {
      return run_virtual(
                 lps, end,
                 {.processors = 2, .window = 8, .synchronisation = policy, .latency_ns = 5000})
          .run;
    });
  return all;
}

// LP 1 must hear from LP 0 at every tick before it runs there, else it throws: an optimistic run
// does that again and again, for nothing.
TEST(Failures, AnExceptionThatIsRolledBackIsNotThrown) {
  std::atomic<int> thrown = 0;
  std::uint64_t failed = 0;
  for (const auto& [name, run] : all_executors()) {
    SCOPED_TRACE(name);
    ScriptedProcess::Script teller{.future_events = every_tick(40)};
    teller.on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
      outbox.send(LpId{1}, {now.t, 1}, 0, number(1));
    };
    ScriptedProcess::Script listener;
    for (std::int64_t t = 0; t < 40; ++t) listener.future_events.push_back(at(t, 2));
    listener.on_execute = [&](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
      outbox.send(LpId{0}, at(now.t + 1), 0, number(self.state.sum));
      const std::uint64_t heard = self.state.sum;
      self.state.sum = 1000;  // what an exception leaves is nobody's business
      if (heard != static_cast<std::uint64_t>(now.t) + 1) {
        ++thrown;
        if (now.t % 2 == 0) throw std::bad_alloc();
        throw 7;
      }
      self.state.sum = heard;
    };
    const Lps lps = make_lps({teller, listener});
    const RunResult result = run(lps, at(40));
    EXPECT_EQ(result.counters.committed, 40u + 80u);
    EXPECT_EQ(scripted(lps, 1).commits.size(), 80u);
    failed += result.counters.failed;
  }
  EXPECT_GT(thrown, 0) << "nothing was thrown in speculation: the test proves nothing";
  EXPECT_EQ(failed, static_cast<std::uint64_t>(thrown));
}

TEST(Failures, AnExceptionThatStandsIsThrownWhenAllBeforeItIsCommittedAndNothingElse) {
  for (const auto& [name, run] : all_executors()) {
    SCOPED_TRACE(name);
    ScriptedProcess::Script sound{.future_events = every_tick(60)};
    sound.on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
      outbox.send(LpId{2}, {now.t, 1}, 0, number(1));
    };
    ScriptedProcess::Script failing{.future_events = every_tick(60)};
    failing.on_execute = [](auto&, VirtualTime now, auto, Outbox&) {
      if (now.t == 20) throw std::runtime_error("out of paper");
    };
    ScriptedProcess::Script later = failing;
    later.on_execute = [](auto&, VirtualTime now, auto, Outbox&) {
      if (now == at(20, 1)) throw std::logic_error("not the first");
    };
    const Lps lps = make_lps({sound, failing, later});
    try {
      run(lps, at(60));
      ADD_FAILURE() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "out of paper");
    }
    EXPECT_EQ(scripted(lps, 0).commits, every_tick(20));
    EXPECT_EQ(scripted(lps, 1).commits, every_tick(20));
    EXPECT_EQ(scripted(lps, 2).commits.size(), 40u);
  }
}

TEST(Failures, WhatAHandlerThrowsFromOneExecutionItTellsAfterAFaultIsNotCounted) {
  for (const auto& [name, run] : all_executors()) {
    SCOPED_TRACE(name);
    ScriptedProcess::Script failing{.future_events = every_tick(9)};
    failing.on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
      if (now.t != 4) return;
      outbox.fault({1, "first"});
      throw std::runtime_error("second");
    };
    const RunResult result = run(make_lps({failing, {}}), at(9));
    ASSERT_TRUE(result.fault);
    EXPECT_EQ(result.fault->fault.what, "first");
  }
}

// An exception has no subject: it comes before the faults of its time, whichever LP it leaves.
TEST(Failures, AnExceptionComesBeforeTheFaultsOfItsTime) {
  for (const auto& [name, run] : all_executors()) {
    SCOPED_TRACE(name);
    ScriptedProcess::Script faulty{.future_events = every_tick(9)};
    faulty.on_execute = [](auto&, VirtualTime now, auto, Outbox& outbox) {
      if (now.t == 4) outbox.fault({1, "a fault"});
    };
    ScriptedProcess::Script failing = faulty;
    failing.on_execute = [](auto&, VirtualTime now, auto, Outbox&) {
      if (now.t == 4) throw std::runtime_error("an exception");
    };
    EXPECT_THROW(run(make_lps({faulty, failing}), at(9)), std::runtime_error);
    EXPECT_THROW(run(make_lps({failing, faulty}), at(9)), std::runtime_error);
  }
}

// Of an execution that is repeated, an exception is not the model's.
TEST(Failures, AnExceptionWhileCoastingIsThrownAtOnce) {
  bool throws = false;
  ScriptedProcess::Script script{.future_events = every_tick(9), .mark_every_t = 10};
  script.on_execute = [&](auto&, VirtualTime, auto, Outbox&) {
    if (throws) throw std::bad_alloc();
  };
  Bench bench(std::move(script));
  bench.execute_all();
  bench.deliver(at(6), 1, 1);
  throws = true;
  EXPECT_THROW(bench.process.execute(bench.effects), std::bad_alloc);
  EXPECT_FALSE(bench.process.first_fault());
}

// Who has failed is asked for nothing until it is rolled back.
TEST(Failures, AFailedProcessExecutesNothingUntilItIsRolledBack) {
  Bench bench({.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox&) {
    if (now == at(5) && self.state.sum < 10) throw std::runtime_error("too little");
  }});
  bench.deliver(at(5), 1, 1);
  bench.deliver(at(8), 1, 2);
  bench.execute_all();
  EXPECT_EQ(bench.process.next_time(), kNever);
  bench.deliver(at(7), 1, 3);
  EXPECT_EQ(bench.process.next_time(), kNever);
  ASSERT_TRUE(bench.process.first_fault());
  EXPECT_EQ(bench.process.first_fault()->fault.what, "too little");
  bench.deliver(at(4), 10, 4);
  EXPECT_FALSE(bench.process.first_fault());
  bench.execute_all();
  EXPECT_EQ(bench.lp.executions, (Times{at(5), at(4), at(5), at(7), at(8)}));
  EXPECT_EQ(bench.lp.state.sum, 13u);
}

// A message that comes late, is absorbed and then taken back: the time was never executed in
// sequence, so it is not committed.
TEST(Failures, ABagOfWhichNothingIsLeftIsNotCommitted) {
  ScriptedProcess::Script script{.future_events = {at(1), at(9)}};
  script.on_absorb = [](auto&, VirtualTime, auto) { return true; };
  Bench bench(std::move(script));
  bench.execute_all();
  bench.deliver(at(5), 1, 1);
  EXPECT_EQ(bench.effects.counters.absorbed, 1u);
  bench.deliver_anti(at(5), 2);
  // The same in one go: nothing has changed.
  bench.process.deliver({{at(6), kSelf, 7, 0}, LpId{2}, 3, false, number(1)}, bench.effects);
  bench.process.deliver({{at(6), kSelf, 7, 0}, LpId{2}, 4, true, {}}, bench.effects);
  bench.process.settle(bench.effects);
  bench.execute_all();
  bench.advance_gvt(kEnd);
  EXPECT_EQ(bench.lp.commits, (Times{at(1), at(9)}));
  EXPECT_EQ(bench.lp.executions.back(), at(9));
}

TEST(Failures, ABagOfWhichNothingIsLeftIsCommittedIfTheFutureEventListAsksForIt) {
  ScriptedProcess::Script script{.future_events = {at(1), at(5), at(9)}};
  script.on_absorb = [](auto&, VirtualTime, auto) { return true; };
  Bench bench(std::move(script));
  bench.execute_all();
  bench.deliver(at(5), 1, 1);
  bench.deliver_anti(at(5), 2);
  EXPECT_EQ(bench.effects.counters.absorbed, 2u);
  bench.advance_gvt(kEnd);
  EXPECT_EQ(bench.lp.commits, (Times{at(1), at(5), at(9)}));
}

TEST(FailuresDeathTest, AFutureEventBeforeAllTimesIsToldByEveryExecutor) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  for (const auto& [name, run] : all_executors()) {
    SCOPED_TRACE(name);
    EXPECT_DEATH(run(make_lps({{.future_events = {kBeginning, at(3)}}, {}}), at(9)),
                 "future event list of LP 0 begins at .* earlier than every time");
  }
}

long address_space_bytes() {
  std::ifstream file("/proc/self/statm");
  long pages = 0;
  file >> pages;
  return pages * sysconf(_SC_PAGESIZE);
}

// In a process of its own, where there is memory for the stacks of a few threads only.
[[noreturn]] void run_with_few_threads() {
  alarm(30);  // who waits for threads that are not there waits for ever
  const Lps lps =
      make_lps(std::vector<ScriptedProcess::Script>(64, {.future_events = every_tick(50)}));
  rlimit limit{};
  getrlimit(RLIMIT_AS, &limit);
  limit.rlim_cur = static_cast<rlim_t>(address_space_bytes()) + (rlim_t{90} << 20);
  setrlimit(RLIMIT_AS, &limit);
  try {
    run_threads(lps, at(50), {.threads = 64, .window = 4});
  } catch (const ThreadsNotStarted& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::exit(3);
  }
  std::exit(0);
}

TEST(FailuresDeathTest, ThreadsThatTheSystemRefusesEndTheRunAndItIsSaidHowManyThereWere) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer needs more address space than the limit leaves";
#else
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(run_with_few_threads(), testing::ExitedWithCode(3),
              "of 64 worker threads only ([2-9]|[1-5][0-9]) could be started");
#endif
}

// The link of a rank computes GVT: its only worker does not.
TEST(Failures, TheOnlyWorkerOfAJobLeavesGvtToTheRanks) {
  for (int round = 0; round < 20; ++round) {
    ScriptedProcess::Script busy{.future_events = every_tick(400), .mark_every_t = 7};
    busy.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
      if (now.round < 2)
        outbox.send(LpId{static_cast<std::uint32_t>(now.t % 4)}, {now.t, now.round + 1}, 0,
                    number(self.state.sum % 3 + 1));
    };
    const Lps lps = make_lps(std::vector<ScriptedProcess::Script>(4, busy));
    const RunResult result = RankThreads::run(1, lps, at(400), {.threads = 1, .window = 48});
    EXPECT_EQ(result.counters.alone, 0u);
    EXPECT_EQ(scripted(lps, 0).commits.back().t, 399);
  }
}

}  // namespace
}  // namespace soda::kernel
