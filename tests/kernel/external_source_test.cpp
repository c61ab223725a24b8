// Messages from outside the LPs, under every executor: in time, in order, and committed alike.
#include "kernel/api/external_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "kernel/api/checkers.hpp"
#include "kernel/api/hash_mix.hpp"
#include "kernel/phold/phold.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "tests/kernel/rank_threads.hpp"

namespace soda::kernel {
namespace {

constexpr VirtualTime kEnd{60, 0};

// As PHOLD's events: three words.
struct Word {
  std::uint64_t token, state_word, hops_left;
};

struct Stamped {
  VirtualTime time;
  LpId destination{};
  std::uint64_t token = 0;
};

Message message_of(const Stamped& stamped, std::uint64_t slot) {
  Message message;
  message.slot = static_cast<std::uint32_t>(slot);
  message.time = stamped.time;
  message.destination = stamped.destination;
  message.payload = Payload::of(Word{stamped.token, 0, 1});
  return message;
}

std::vector<Stamped> random_script(std::uint64_t seed, std::uint32_t lps) {
  SplitMix64 random(seed);
  std::vector<Stamped> script;
  for (int i = 0; i < 40; ++i) {
    const auto t = static_cast<std::int64_t>(random.below(62));
    const auto round = static_cast<std::uint32_t>(random.below(3));
    script.push_back({{t, round}, LpId{static_cast<std::uint32_t>(random.below(lps))}, seed + i});
  }
  std::stable_sort(script.begin(), script.end(),
                   [](const Stamped& a, const Stamped& b) { return a.time < b.time; });
  return script;
}

// Sends what is written down: all at once, or each when GVT stands at its time and goes no further.
class Script : public ExternalSource {
 public:
  Script(std::vector<Stamped> script, bool at_the_last_moment)
      : script_(std::move(script)), at_the_last_moment_(at_the_last_moment) {}

  VirtualTime floor() override {
    return floor_ = sent_ < script_.size() ? script_[sent_].time : kNever;
  }

  void take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out) override {
    EXPECT_LE(gvt, earliest);
    EXPECT_LE(earliest, floor_);
    EXPECT_GE(gvt, gvt_);
    gvt_ = gvt;
    const VirtualTime until = at_the_last_moment_ ? gvt : kNever;
    for (; sent_ < script_.size() && script_[sent_].time <= until; ++sent_)
      out.push_back(message_of(script_[sent_], sent_));
  }

  VirtualTime last_floor() const { return floor_; }
  bool has_sent_all() const { return sent_ == script_.size(); }

 private:
  const std::vector<Stamped> script_;
  const bool at_the_last_moment_;
  std::size_t sent_ = 0;
  VirtualTime floor_ = kBeginning;
  VirtualTime gvt_ = kBeginning;
};

// Holds nothing back, sends at the earliest time that it is offered, and writes that down.
class Live : public ExternalSource {
 public:
  explicit Live(std::uint32_t lps) : lps_(lps) {}

  VirtualTime floor() override { return kNever; }

  void take(VirtualTime, VirtualTime earliest, std::vector<Message>& out) override {
    if (++calls_ % 3 != 0 || log_.size() == 50) return;
    log_.push_back({earliest, LpId{static_cast<std::uint32_t>(calls_ % lps_)}, calls_});
    out.push_back(message_of(log_.back(), log_.size() - 1));
  }

  const std::vector<Stamped>& log() const { return log_; }

 private:
  const std::uint32_t lps_;
  std::uint64_t calls_ = 0;
  std::vector<Stamped> log_;
};

using Lps = std::span<const std::unique_ptr<LogicalProcess>>;

struct Executor {
  std::string name;
  std::function<RunResult(Lps, ExternalSource&, const ProgressFn&, std::uint64_t seed)> run;
};

std::vector<Executor> executors() {
  std::vector<Executor> all;
  all.push_back(
      {"sequential", [](Lps lps, ExternalSource& external, const ProgressFn& progress, auto) {
         return run_sequential(lps, kEnd, progress, &external);
       }});
  for (const auto how : {Synchronisation::kOptimistic, Synchronisation::kLockstep}) {
    const std::string name = how == Synchronisation::kLockstep ? ", lockstep" : "";
    for (const unsigned threads : {1u, 3u})
      all.push_back({std::to_string(threads) + " threads" + name,
                     [=](Lps lps, ExternalSource& external, const ProgressFn& progress, auto seed) {
                       return run_threads(lps, kEnd,
                                          {.threads = threads,
                                           .window = 10,
                                           .scheduling_seed = seed % 3,
                                           .synchronisation = how,
                                           .external = &external},
                                          progress);
                     }});
    for (const std::uint32_t ranks : {2u, 3u})
      all.push_back({std::to_string(ranks) + " ranks" + name,
                     [=](Lps lps, ExternalSource& external, const ProgressFn& progress, auto seed) {
                       return RankThreads::run(ranks, lps, kEnd,
                                               {.threads = 2,
                                                .window = 10,
                                                .scheduling_seed = seed % 3,
                                                .synchronisation = how,
                                                .external = &external},
                                               progress);
                     }});
    all.push_back({"virtual" + name,
                   [=](Lps lps, ExternalSource& external, const ProgressFn& progress, auto seed) {
                     GvtChecker gvt;
                     ConservationChecker conservation;
                     ObserverList observers({&gvt, &conservation});
                     const bool observes = how == Synchronisation::kOptimistic;
                     return run_virtual(lps, kEnd,
                                        {.processors = 3,
                                         .window = 10,
                                         .synchronisation = how,
                                         .seed = seed,
                                         .jitter_ns = 5000,
                                         .gvt_interval_ns = 3000,
                                         .observer = observes ? &observers : nullptr,
                                         .external = &external},
                                        progress)
                         .run;
                   }});
  }
  return all;
}

PholdOptions model_of(std::uint64_t seed) {
  return {.lps = 9,
          .remote_per_mille = 500,
          .zero_delay_rounds = 1,
          .doubled_per_mille = 200,
          .seed = seed};
}

TEST(ExternalSource, AScriptIsCommittedAlikeByAllExecutorsAndGvtNeverPassesItsFloor) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const PholdOptions model = model_of(seed);
    const std::vector<Stamped> script = random_script(seed, model.lps);
    const auto oracle = make_phold(model);
    Script all_at_once(script, false);
    const RunResult expected = run_sequential(oracle, kEnd, {}, &all_at_once);
    const auto alone = make_phold(model);
    run_sequential(alone, kEnd);
    ASSERT_NE(phold_digest(oracle), phold_digest(alone));
    for (const Executor& executor : executors())
      for (const bool at_the_last_moment : {false, true}) {
        const auto lps = make_phold(model);
        Script external(script, at_the_last_moment);
        const ProgressFn progress = [&](VirtualTime gvt, const Counters&) {
          EXPECT_LE(gvt, external.last_floor());
        };
        const RunResult found = executor.run(lps, external, progress, seed);
        EXPECT_EQ(phold_digest(lps), phold_digest(oracle))
            << executor.name << ", seed " << seed << ", last moment " << at_the_last_moment;
        EXPECT_EQ(found.counters.committed, expected.counters.committed) << executor.name;
      }
  }
}

TEST(ExternalSource, MessagesAtTheLastMomentRollBackWhatRanAheadOfThem) {
  const PholdOptions model = model_of(7);
  const auto lps = make_phold(model);
  Script external(random_script(7, model.lps), true);
  const RunResult found = run_threads(lps, kEnd, {.window = 10, .external = &external});
  EXPECT_GT(found.counters.stragglers, 0u);
}

TEST(ExternalSource, WhatCameAtTheEarliestTimeIsCommittedAgainFromItsLog) {
  for (const Executor& executor : executors()) {
    const PholdOptions model = model_of(3);
    const auto lps = make_phold(model);
    Live live(model.lps);
    executor.run(lps, live, {}, 2);
    EXPECT_FALSE(live.log().empty()) << executor.name;
    const auto again = make_phold(model);
    Script script(live.log(), false);
    run_sequential(again, kEnd, {}, &script);
    EXPECT_EQ(phold_digest(again), phold_digest(lps)) << executor.name;
  }
}

// An LP with nothing to do by itself: without the source there would be no run at all.
TEST(ExternalSource, TheRunLastsForAsLongAsTheFloorIsBeforeTheEnd) {
  for (const Executor& executor : executors()) {
    const auto lps = make_phold({.lps = 4, .start_events_per_lp = 0});
    Script external({{{50, 2}, LpId{1}, 5}}, true);
    const RunResult found = executor.run(lps, external, {}, 0);
    EXPECT_TRUE(external.has_sent_all()) << executor.name;
    EXPECT_GT(found.counters.committed, 4u) << executor.name;
  }
}

// Each call of floor() lets time go on a little, as a clock would.
class Clock : public ExternalSource {
 public:
  VirtualTime floor() override { return {calls_++ / 8, 0}; }
  void take(VirtualTime, VirtualTime, std::vector<Message>&) override {}

 private:
  std::int64_t calls_ = 0;
};

TEST(ExternalSource, AClockPacesTheRunAndChangesNothing) {
  const PholdOptions model = model_of(5);
  const auto oracle = make_phold(model);
  run_sequential(oracle, kEnd);
  for (const Executor& executor : executors()) {
    const auto lps = make_phold(model);
    Clock clock;
    executor.run(lps, clock, {}, 0);
    EXPECT_EQ(phold_digest(lps), phold_digest(oracle)) << executor.name;
  }
}

TEST(ExternalSourceDoor, KeepsTheSlotsOfMessagesAndDropsWhatIsBeyondTheEnd) {
  Script external({{{5, 0}, LpId{1}, 1}, {{5, 0}, LpId{1}, 2}, {{5, 0}, LpId{0}, 3}, {kEnd, {}, 4}},
                  false);
  ExternalSourceDoor door(&external, 2, kEnd);
  EXPECT_EQ(door.hold({9, 0}), (VirtualTime{5, 0}));
  std::vector<Message> taken;
  door.take({4, 0}, {4, 0}, taken);
  ASSERT_EQ(taken.size(), 3u);
  EXPECT_EQ(taken[0].slot, 0u);
  EXPECT_EQ(taken[1].slot, 1u);
  EXPECT_EQ(taken[2].slot, 2u);
  EXPECT_LT(taken[1].version, taken[2].version);
  EXPECT_EQ(taken[0].source, kExternalSource);
  EXPECT_EQ(ExternalSourceDoor(nullptr, 2, kEnd).hold({9, 0}), (VirtualTime{9, 0}));
}

TEST(ExternalSourceDoorDeath, ASlotOfADestinationAndTimeIsTakenOnce) {
  class Twice : public ExternalSource {
   public:
    VirtualTime floor() override { return kNever; }
    void take(VirtualTime, VirtualTime, std::vector<Message>& out) override {
      out.push_back(message_of({{5, 0}, LpId{0}, 1}, 7));
    }
  };
  Twice twice;
  ExternalSourceDoor door(&twice, 1, kEnd);
  std::vector<Message> taken;
  door.take({4, 0}, {4, 0}, taken);
  EXPECT_DEATH(door.take({5, 0}, {5, 0}, taken), "twice to LP 0");
}

TEST(ExternalSourceList, HoldsAtTheEarliestFloorAndSendsWhatAllHave) {
  Script early({{{5, 0}, LpId{1}, 1}}, false), late({{{7, 0}, LpId{0}, 2}}, false);
  ExternalSourceList both({&late, &early});
  EXPECT_EQ(both.floor(), (VirtualTime{5, 0}));
  std::vector<Message> taken;
  both.take({4, 0}, {4, 0}, taken);
  ASSERT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken[0].time, (VirtualTime{7, 0}));
  EXPECT_EQ(both.floor(), kNever);
}

TEST(ExternalSourceDoorDeath, AMessageThatComesTooLateIsABrokenSource) {
  class Late : public ExternalSource {
   public:
    VirtualTime floor() override { return kNever; }
    void take(VirtualTime, VirtualTime, std::vector<Message>& out) override {
      out.push_back(message_of({{3, 9}, LpId{0}, 1}, 0));
    }
  };
  Late late;
  ExternalSourceDoor door(&late, 1, kEnd);
  std::vector<Message> taken;
  EXPECT_DEATH(door.take({4, 0}, {4, 0}, taken), "the earliest time is");
}

}  // namespace
}  // namespace soda::kernel
