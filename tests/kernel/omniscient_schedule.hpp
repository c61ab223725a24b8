// Time Warp processes driven by an omniscient scheduler: it delivers any message that is on its
// way, executes any LP, or collects fossils, in whatever order it is told. After every single
// action it knows the true GVT, which must never go back.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {

using Lps = std::vector<std::unique_ptr<LogicalProcess>>;
// Draws one of the numbers 0 .. count - 1.
using Chooser = std::function<std::size_t(std::size_t count)>;

enum class Collect { kAtOnce, kWhenChosen };  // fossils

// Whether a message that could be the next execution of its receiver is executed as it arrives.
enum class Arrival { kWaits, kIsExecutedIfInOrder };

class Schedule {
 public:
  Schedule(const Lps& lps, VirtualTime end, Collect collect, Arrival arrival = Arrival::kWaits)
      : end_(end), collect_(collect), arrival_(arrival) {
    for (std::uint32_t i = 0; i < lps.size(); ++i)
      processes_.emplace_back(LpId{i}, lps.size(), *lps[i], end, pool_, journal_);
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
    for (TimeWarpProcess& process : processes_) {
      process.take_back(effects_.counters);
      process.commit(end_, effects_);
    }
    return actions;
  }

  const Counters& counters() const { return effects_.counters; }
  std::uint64_t executed_in_order() const { return executed_in_order_; }

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
      process.commit(gvt_, effects_);
      process.forget(gvt_);
    }
    for (auto number = journal_.first_number(); number < journal_.next_number(); ++number) {
      const Journal::Entry& entry = journal_[number];
      if (entry.lp != nullptr && entry.time() < gvt_)
        entry.lp->collect_in_order(number, gvt_, effects_);
    }
    journal_.drop_taken();
    collected_ = gvt_;
  }

  void deliver(std::size_t i) {
    Message message = std::move(effects_.outgoing[i]);
    effects_.outgoing.erase(effects_.outgoing.begin() + static_cast<std::ptrdiff_t>(i));
    TimeWarpProcess& receiver = processes_[index_of(message.destination)];
    const VirtualTime time = message.time;
    if (arrival_ == Arrival::kIsExecutedIfInOrder && message.first && receiver.is_plain() &&
        receiver.takes_in_order(time)) {
      ++executed_in_order_;
      const std::uint32_t place = pool_.put(std::move(message));
      pool_[place].next = MessagePool::kNone;
      receiver.execute_in_order(time, place, 1, effects_);
      return;
    }
    receiver.deliver(std::move(message), effects_);
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
  const Arrival arrival_;
  std::uint64_t executed_in_order_ = 0;
  MessagePool pool_;
  Journal journal_;
  std::deque<TimeWarpProcess> processes_;
  WorkerEffects effects_;  // .outgoing: what is on its way
  VirtualTime gvt_ = kBeginning;
  VirtualTime collected_ = kBeginning;
};

}  // namespace soda::kernel
