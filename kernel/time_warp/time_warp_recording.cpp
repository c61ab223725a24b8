// What a process tells the recorder of its worker.
#include <utility>

#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {

// A late one is told with what it says, or with what it takes away.
bool TimeWarpProcess::deliver_recorded(Message&& message, WorkerEffects& effects) {
  effects.recorder->arrived(message);
  if (!needs_rollback(message.time)) return deliver_any(std::move(message), effects);
  Message told = message;
  if (message.anti) {
    take_back(effects.counters);
    if (const Message* const old = inputs_.find_executed(message)) told.payload = old->payload;
  }
  const std::uint64_t late = effects.counters.stragglers;
  const bool settles = deliver_any(std::move(message), effects);
  if (effects.counters.stragglers > late) effects.recorder->late(told);
  return settles;
}

void TimeWarpProcess::tell_adopted(const OutputId& id, VirtualTime now,
                                   EventRecorder& recorder) const {
  recorder.adopted({id, id_, 0, false, {}}, now);
}

void TimeWarpProcess::tell_undone(std::size_t standing, VirtualTime restart, VirtualTime changed,
                                  EventRecorder& recorder) const {
  const bool tells = rare_ && rare_->has_refused;
  recorder.rewound(id_, restart, changed, tells ? lp_.refusal() : Refusal{});
  for (std::size_t i = executed_.size(); i > standing; --i)
    recorder.rolled_back(id_, executed_[i - 1].time());
}

// Messages that came by the calendar have not been told yet. Returns when that was.
std::int64_t TimeWarpProcess::tell_arrived(std::uint32_t first_input,
                                           EventRecorder& recorder) const {
  const MessagePool& pool = inputs_.pool();
  for (std::uint32_t place = first_input; place != MessagePool::kNone; place = pool[place].next)
    recorder.arrived(pool[place]);
  return recorder.now_ns();
}

}  // namespace soda::kernel
