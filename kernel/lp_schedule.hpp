// The LPs of one worker, the one with the earliest floor on top.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernel/calendar_queue.hpp"
#include "kernel/virtual_time.hpp"

namespace soda::kernel {

// As LpHeap, for many LPs and frequent changes: each change queues a new entry, and entries that
// are no longer true are dropped when they come to the top.
class LpSchedule {
 public:
  explicit LpSchedule(std::size_t size) : times_(size, kNever) {}

  std::size_t size() const { return times_.size(); }
  VirtualTime time_of(std::uint32_t lp) const { return times_[lp]; }

  // kNever: nothing to do.
  void update(std::uint32_t lp, VirtualTime time) {
    if (times_[lp] == time) return;
    times_[lp] = time;
    if (time < kNever) queue_.push({time.t, time.round, lp}, {});
  }

  // The earliest time of all; kNever if there is nothing to do.
  VirtualTime top_time() {
    drop_untrue();
    if (queue_.empty()) return kNever;
    return {queue_.top().t, queue_.top().round};
  }

  // Takes out the lowest LP of the earliest time, which is not kNever: it has nothing to do until
  // it is updated.
  std::uint32_t take() {
    drop_untrue();
    const std::uint32_t lp = queue_.top().lp;
    queue_.pop();
    times_[lp] = kNever;
    return lp;
  }

 private:
  struct Nothing {};

  void drop_untrue() {
    while (!queue_.empty()) {
      const auto& key = queue_.top();
      if (times_[key.lp] == VirtualTime{key.t, key.round}) return;
      queue_.pop();
    }
  }

  std::vector<VirtualTime> times_;
  CalendarQueue<Nothing> queue_;
};

}  // namespace soda::kernel
