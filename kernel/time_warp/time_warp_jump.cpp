// Jump forward: a rollback keeps what it undoes; once the LP is back in a state that it had, and
// its inputs are the same, is revalidated.
#include <algorithm>
#include <iterator>

#include "kernel/api/invariant.hpp"
#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {

// What is undone now takes the place of what was undone of the same times before. What was undone
// later than that came after other executions, unless these had led to the same state.
void TimeWarpProcess::note_undone(std::size_t standing, bool was_as_before) {
  if (standing == executed_.size()) return;
  std::vector<Executed>& undone = rare().undone;
  const VirtualTime last = executed_.back().time();
  while (!undone.empty() && undone.back().time() <= last) undone.pop_back();
  if (!undone.empty() && !was_as_before) rare_->different.push_back(undone.back().time());
  for (std::size_t i = executed_.size(); i > standing; --i) undone.push_back(executed_[i - 1]);
}

// Of what has been executed anew.
void TimeWarpProcess::drop_replaced(VirtualTime now) {
  std::vector<Executed>& undone = rare_->undone;
  while (!undone.empty() && undone.back().time() <= now) undone.pop_back();
  if (undone.empty())
    rare_->different.clear();
  else
    std::erase_if(rare_->different, [now](VirtualTime time) { return time <= now; });
}

// The time of the first undone execution that would come out differently or whose outputs are not
// all there any more; just after the last one if there is none.
VirtualTime TimeWarpProcess::end_of_restorable() const {
  const VirtualTime last = rare_->undone.front().time();
  VirtualTime end{last.t, last.round + 1};
  for (const VirtualTime time : rare_->different) end = std::min(end, time);
  auto output = rare_->pending_order.rbegin();
  for (auto record = rare_->undone.rbegin(); record != rare_->undone.rend(); ++record) {
    if (record->time() >= end) break;
    std::uint32_t there = 0;
    for (; output != rare_->pending_order.rend() && output->first <= record->time(); ++output) {
      const auto found = rare_->pending.find(output->second);
      there += found != rare_->pending.end() && found->second.send_time == record->time();
    }
    if (there != record->outputs) return record->time();
  }
  return end;
}

void TimeWarpProcess::jump(WorkerEffects& effects) {
  const VirtualTime limit = end_of_restorable();
  if (limit <= next_time_) return;
  lp_.jump(limit);
  const VirtualTime resume = lp_.next_time();
  SODA_ASSERT(resume <= limit, "LP ", index_of(id_), " jumps to ", resume, ", allowed is ", limit);
  std::vector<Executed>& undone = rare_->undone;
  if (resume > next_time_) {
    ++effects.counters.jumps;
    if (effects.recorder != nullptr) effects.recorder->jumped(id_, resume);
  }
  for (; !undone.empty() && undone.back().time() < resume; undone.pop_back())
    restore(undone.back(), effects);
  inputs_.pass_to(resume);
  refresh_future_event();
  refresh_next_time();
}

// Outputs come back in the order in which they were sent: they were undone in the reverse one.
void TimeWarpProcess::restore(const Executed& record, WorkerEffects& effects) {
  auto& [faults, pending, order, undone, different, changed, refused] = *rare_;
  while (!order.empty() && order.back().first <= record.time()) {
    const auto [send_time, id] = order.back();
    order.pop_back();
    const auto found = pending.find(id);
    if (found == pending.end() || found->second.send_time != send_time) continue;
    SODA_ASSERT(send_time == record.time(), "LP ", index_of(id_), " has an output of ", send_time,
                " left at ", record.time());
    slots_.take_again(id, kept_);
    outputs_.push_back(std::move(found->second.payload));
    pending.erase(found);
  }
  executed_.push_back(record);
  --effects.counters.rolled_back;
  if (effects.recorder != nullptr) effects.recorder->put_back(id_, record.time());
  effects.revalidated.push_back(record.time());
}

}  // namespace soda::kernel
