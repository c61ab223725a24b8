// What Time Warp holds for rollback is bounded by the window, under every executor, however long
// the run. The traffic is such that the bound can be counted.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "kernel/api/hash_mix.hpp"
#include "kernel/virtual_cluster/adversary.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "tests/kernel/rank_threads.hpp"
#include "tests/kernel/scripted_process.hpp"
#include "tests/kernel/time_warp_bench.hpp"

namespace soda::kernel {
namespace {

using bench::at;
using bench::Bench;
using Lps = std::vector<std::unique_ptr<LogicalProcess>>;

constexpr std::uint32_t kLps = 6;

// Every LP executes every tick and sends one message a tick to an LP that its state chooses, for
// the next tick: stragglers are the rule. Restart points every `mark_every_t` ticks.
Lps every_tick(std::int64_t end_t, std::int64_t mark_every_t) {
  ScriptedProcess::Script script{.mark_every_t = mark_every_t};
  for (std::int64_t t = 0; t < end_t; ++t) script.future_events.push_back({t, 0});
  script.on_execute = [](ScriptedProcess& self, VirtualTime now, auto bag, Outbox& outbox) {
    for (const MessageView& message : bag)
      self.state.sum = append(self.state.sum, index_of(message.source));
    const auto destination = static_cast<std::uint32_t>(mix64(self.state.sum + 1) % kLps);
    outbox.send(LpId{destination}, {now.t + 1, 0}, 0, number(self.state.sum % 3));
  };
  Lps lps;
  for (std::uint32_t i = 0; i < kLps; ++i) lps.push_back(std::make_unique<ScriptedProcess>(script));
  return lps;
}

// Entries of one LP. When it commits, what it executed and keeps lies in the ticks from its last
// restart point not after the GVT before, up to the window beyond that GVT: `ticks` of them. One
// execution and one output a tick, and one output more that is still to be cancelled. Message ids
// of inputs: one a source and tick, up to the tick after the last that somebody executed. Where
// others execute at the same time, they may have run ahead of a newer GVT, which is not beyond this
// LP's window, while it still holds what it will collect when it executes next.
std::uint64_t bound(std::int64_t window, std::int64_t mark_every_t, bool shared) {
  const auto ticks = static_cast<std::uint64_t>(window + mark_every_t);
  const auto ticks_of_inputs = ticks + 1 + (shared ? static_cast<std::uint64_t>(window) : 0);
  return ticks + (ticks + 1) + kLps * ticks_of_inputs;
}

// A way to run LPs with a window. Every executor of the kernel belongs into all_ways().
struct Way {
  std::string name;
  bool shared;  // by several workers
  bool alone;   // nobody else sends, and it executes in order
  std::function<Counters(const Lps&, VirtualTime end, std::int64_t window)> run;
};

std::vector<Way> all_ways() {
  std::vector<Way> ways;
  for (const unsigned threads : {1u, 2u, 4u}) {
    for (const std::uint64_t seed : {0, 1}) {
      ways.push_back(
          {describe("threads ", threads, ", seed ", seed), threads > 1, threads == 1 && seed == 0,
           [=](const Lps& lps, VirtualTime end, std::int64_t window) {
             return run_threads(lps, end,
                                {.threads = threads, .window = window, .scheduling_seed = seed})
                 .counters;
           }});
    }
  }
  for (const std::uint32_t ranks : {2u, 3u}) {
    for (const std::uint64_t seed : {0, 1}) {
      ways.push_back({describe(ranks, " ranks, seed ", seed), true, false,
                      [=](const Lps& lps, VirtualTime end, std::int64_t window) {
                        return RankThreads::run(
                                   ranks, lps, end,
                                   {.threads = 1, .window = window, .scheduling_seed = seed})
                            .counters;
                      }});
    }
  }
  for (const std::uint64_t seed : {0, 1, 2, 3}) {
    ways.push_back({describe("virtual, adversary ", seed), false, false,
                    [=](const Lps& lps, VirtualTime end, std::int64_t window) {
                      Adversary adversary(draw_adversary(seed, kLps, 1000));
                      return run_virtual(lps, end,
                                         {.processors = 1 + kLps / 2,
                                          .window = window,
                                          .jitter_ns = 5000,
                                          .gvt_interval_ns = 3000,
                                          .adversary = seed == 0 ? nullptr : &adversary})
                          .run.counters;
                    }});
  }
  return ways;
}

TEST(Memory, IsBoundedByTheWindowUnderEveryExecutorHoweverLongTheRun) {
  std::uint64_t rollbacks = 0;
  for (const Way& way : all_ways()) {
    for (const std::int64_t window : {1, 4, 16}) {
      for (const std::int64_t mark_every_t : {1, 5}) {
        for (const std::int64_t end_t : {200, 800}) {
          const Lps lps = every_tick(end_t, mark_every_t);
          const Counters counters = way.run(lps, {end_t, 0}, window);
          EXPECT_EQ(counters.committed, static_cast<std::uint64_t>(end_t) * kLps);
          EXPECT_LE(counters.history_max, bound(window, mark_every_t, way.shared))
              << way.name << ", window " << window << ", marks every " << mark_every_t << ", "
              << end_t << " ticks";
          if (way.alone) {  // it collects at once, whatever the window
            EXPECT_LE(counters.history_max, bound(1, mark_every_t, false)) << way.name;
          } else if (window == 16) {
            EXPECT_GT(counters.history_max, bound(1, mark_every_t, way.shared))
                << "the window was not used";
          }
          rollbacks += counters.rollbacks;
        }
      }
    }
  }
  EXPECT_GT(rollbacks, 1000u);
}

// Lets GVT pass nothing for so many rounds, and counts what an LP has executed by then.
class HeldBack final : public ExternalSource {
 public:
  HeldBack(const ScriptedProcess& lp, int rounds) : lp_(lp), rounds_(rounds) {}
  VirtualTime floor() override {
    if (rounds_ > 0 && --rounds_ == 0) executed_ = lp_.executions.size();
    return rounds_ > 0 ? at(0) : kNever;
  }
  void take(VirtualTime, VirtualTime, std::vector<Message>&) override {}
  std::size_t executed() const { return executed_; }

 private:
  const ScriptedProcess& lp_;
  int rounds_;
  std::size_t executed_ = 0;
};

// Times far apart: no window in units of them would fit.
TEST(Memory, WithoutAWindowAWorkerStopsAfterSoManyExecutionsThatGvtHasNotPassed) {
  constexpr std::size_t kTimes = 5000, kBatch = 64;
  for (const std::uint32_t lp_count : {1u, 4u, 100u}) {
    ScriptedProcess::Script script;
    for (std::size_t i = 0; i < kTimes; ++i)
      script.future_events.push_back(at(static_cast<std::int64_t>(i) * 1'000'000));
    Lps lps;
    lps.push_back(std::make_unique<ScriptedProcess>(script));
    while (lps.size() < lp_count)
      lps.push_back(std::make_unique<ScriptedProcess>(ScriptedProcess::Script{}));
    const auto& busy = static_cast<const ScriptedProcess&>(*lps.front());
    HeldBack external(busy, 100);
    const RunResult run = run_threads(lps, at(kTimes * 1'000'000), {.external = &external});
    EXPECT_EQ(run.counters.committed, kTimes);
    EXPECT_GE(external.executed(), most_uncommitted(lp_count)) << lp_count << " LPs";
    EXPECT_LT(external.executed(), most_uncommitted(lp_count) + kBatch) << lp_count << " LPs";
  }
}

// Of what follows in order, nothing is collected before the next round of GVT.
TEST(Memory, ACheckpointOfATimeThatIsExecutedNoMoreIsCollectedAtOnce) {
  Bench bench({});
  bench.deliver(at(1), 100, 1);
  bench.deliver(at(2), 20, 2);
  bench.execute_all();
  bench.deliver_anti(at(2), 3);
  EXPECT_EQ(bench.lp.history.size(), 2u);
  bench.process.collect(at(3), bench.effects);
  EXPECT_EQ(bench.lp.history.size(), 1u);
}

}  // namespace
}  // namespace soda::kernel
