// Time Warp processes driven by an omniscient scheduler: it delivers any message that is on its
// way, executes any LP, or collects fossils, in an order drawn from a seed, or in every order there
// is. After every single action it knows the true GVT, which must never go back.
#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <string>

#include "kernel/executor.hpp"
#include "kernel/hash_mix.hpp"
#include "kernel/phold.hpp"
#include "kernel/time_warp_process.hpp"
#include "tests/kernel/scripted_process.hpp"

namespace soda::kernel {
namespace {

using Lps = std::vector<std::unique_ptr<LogicalProcess>>;
// Draws one of the numbers 0 .. count - 1.
using Chooser = std::function<std::size_t(std::size_t count)>;

enum class Collect { kAtOnce, kWhenChosen };  // fossils

class Schedule {
 public:
  Schedule(const Lps& lps, VirtualTime end, Collect collect) : end_(end), collect_(collect) {
    for (std::uint32_t i = 0; i < lps.size(); ++i)
      processes_.emplace_back(LpId{i}, lps.size(), *lps[i], end);
  }

  // Runs to the end and returns the number of actions.
  std::size_t run(const Chooser& choose) {
    std::size_t actions = 0;
    for (; gvt_ < end_; ++actions) {
      act(choose);
      const VirtualTime gvt = true_gvt();
      EXPECT_GE(gvt, gvt_) << "GVT went back";
      if (gvt < gvt_ || actions > 1000000) break;
      gvt_ = gvt;
      if (collect_ == Collect::kAtOnce) collect_fossils();
    }
    for (TimeWarpProcess& process : processes_) process.commit(end_, effects_.counters);
    return actions;
  }

  const Counters& counters() const { return effects_.counters; }

 private:
  // Actions: deliver message i; execute the i-th LP that can; collect fossils if GVT has moved.
  void act(const Chooser& choose) {
    std::vector<TimeWarpProcess*> ready;
    for (TimeWarpProcess& process : processes_)
      if (process.next_time() < end_) ready.push_back(&process);
    const std::size_t to_deliver = effects_.outgoing.size();
    const bool can_collect = collect_ == Collect::kWhenChosen && collected_ < gvt_;
    std::size_t choice = choose(to_deliver + ready.size() + can_collect);
    if (choice < to_deliver) return deliver(choice);
    choice -= to_deliver;
    if (choice < ready.size()) return ready[choice]->execute(effects_);
    collect_fossils();
  }

  void collect_fossils() {
    for (TimeWarpProcess& process : processes_) {
      process.commit(gvt_, effects_.counters);
      process.forget(gvt_);
    }
    collected_ = gvt_;
  }

  void deliver(std::size_t i) {
    Message message = std::move(effects_.outgoing[i]);
    effects_.outgoing.erase(effects_.outgoing.begin() + static_cast<std::ptrdiff_t>(i));
    TimeWarpProcess& receiver = processes_[index_of(message.destination)];
    receiver.deliver(std::move(message), effects_.counters);
    receiver.settle(effects_);
  }

  VirtualTime true_gvt() const {
    VirtualTime gvt = kNever;
    for (const TimeWarpProcess& process : processes_) gvt = std::min(gvt, process.floor());
    for (const Message& message : effects_.outgoing) gvt = std::min(gvt, message.time);
    return gvt;
  }

  const VirtualTime end_;
  const Collect collect_;
  std::deque<TimeWarpProcess> processes_;
  WorkerEffects effects_;  // .outgoing: what is on its way
  VirtualTime gvt_ = kBeginning;
  VirtualTime collected_ = kBeginning;
};

TEST(RandomSchedule, AnyOrderOfActionsCommitsTheSequentialDigest) {
  const VirtualTime end{16, 0};
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
    Schedule schedule(lps, end, Collect::kWhenChosen);
    schedule.run([&](std::size_t count) { return random.below(count); });
    ASSERT_EQ(phold_digest(lps), phold_digest(oracle)) << "seed " << seed;
    ASSERT_EQ(schedule.counters().committed, expected.counters.committed) << "seed " << seed;
    rollbacks += schedule.counters().rollbacks;
    anti_messages += schedule.counters().anti_messages;
  }
  EXPECT_GT(rollbacks, 1000u);
  EXPECT_GT(anti_messages, 1000u);
}

// Depth-first through the tree of choices: each call of next() is one path, until all are done.
class EveryPath {
 public:
  std::size_t choose(std::size_t count) {
    if (depth_ == path_.size()) path_.push_back({0, count});
    EXPECT_EQ(path_[depth_].count, count) << "the schedule is not a function of the choices";
    return path_[depth_++].choice;
  }
  bool next() {
    depth_ = 0;
    while (!path_.empty() && ++path_.back().choice == path_.back().count) path_.pop_back();
    return !path_.empty();
  }

 private:
  struct Choice {
    std::size_t choice;
    std::size_t count;
  };
  std::vector<Choice> path_;
  std::size_t depth_ = 0;
};

// LP 0 tells LP 1 at (0, 1). If LP 1 runs at (0, 2) without that, it sends LP 0 a false message for
// (0, 3), so that the sum with which LP 0 runs at (1, 0) is wrong, and so is what it then sends. So
// among the orders there are stragglers at both, chains of rollbacks, an anti-message that
// overtakes what it cancels, and an idle LP that must cancel.
Lps small_network() {
  ScriptedProcess::Script teller{.agenda = {{0, 0}, {1, 0}}};
  teller.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
    if (now == VirtualTime{0, 0}) outbox.send(LpId{1}, {0, 1}, 0, number(1));
    if (now.t == 1) outbox.send(LpId{1}, {1, 1}, 0, number(self.state.sum + 1));
  };
  ScriptedProcess::Script listener{.agenda = {{0, 2}}};
  listener.on_execute = [](ScriptedProcess& self, VirtualTime now, auto, Outbox& outbox) {
    if (now == VirtualTime{0, 2} && self.state.sum != 1) outbox.send(LpId{0}, {0, 3}, 0, number(9));
  };
  Lps lps;
  lps.push_back(std::make_unique<ScriptedProcess>(teller));
  lps.push_back(std::make_unique<ScriptedProcess>(listener));
  return lps;
}

TEST(RandomSchedule, EveryOrderOfASmallNetworkCommitsTheSameTimesAndSums) {
  const auto process = [](const Lps& lps, std::size_t i) -> const ScriptedProcess& {
    return static_cast<const ScriptedProcess&>(*lps[i]);
  };
  const Lps oracle = small_network();
  run_sequential(oracle, {3, 0});
  EveryPath paths;
  std::size_t count = 0;
  std::size_t with_rollback = 0;
  do {
    const Lps lps = small_network();
    Schedule schedule(lps, {3, 0}, Collect::kAtOnce);
    schedule.run([&](std::size_t choices) { return paths.choose(choices); });
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(process(lps, i).commits, process(oracle, i).commits) << "path " << count;
      ASSERT_EQ(process(lps, i).state.sum, process(oracle, i).state.sum) << "path " << count;
    }
    ++count;
    with_rollback += schedule.counters().rollbacks > 0;
  } while (paths.next() && count < 3000000);
  EXPECT_LT(count, 3000000u);
  EXPECT_GT(with_rollback, 0u);
  RecordProperty("paths", std::to_string(count));
  RecordProperty("paths_with_rollback", std::to_string(with_rollback));
}

}  // namespace
}  // namespace soda::kernel
