#include "kernel/time_warp_process.hpp"

#include <algorithm>

#include "kernel/invariant.hpp"

namespace soda::kernel {

class TimeWarpProcess::Sender final : public Outbox {
 public:
  Sender(TimeWarpProcess& process, VirtualTime now, WorkerEffects& effects)
      : process_(process), now_(now), effects_(effects) {}

  void send(LpId destination, VirtualTime when, std::uint32_t kind, Payload payload) override {
    const std::uint32_t lp = index_of(process_.id_);
    SODA_ASSERT(when > now_, "LP ", lp, " executing ", now_, " sends kind ", kind, " to LP ",
                index_of(destination), " at ", when, ", which is not later than its own time");
    SODA_ASSERT(index_of(destination) < process_.lp_count_, "LP ", lp, " at ", now_,
                " sends to LP ", index_of(destination), " of ", process_.lp_count_);
    if (when >= process_.end_) return;
    process_.send(now_, {when, destination, kind, 0}, std::move(payload), effects_);
  }

  void fault(Fault fault) override {
    // While coasting, the record of the first time round still stands.
    auto& faults = process_.faults_;
    if (faults.empty() || faults.back().time < now_) faults.push_back({now_, std::move(fault)});
  }

 private:
  TimeWarpProcess& process_;
  const VirtualTime now_;
  WorkerEffects& effects_;
};

TimeWarpProcess::TimeWarpProcess(LpId id, std::size_t lp_count, LogicalProcess& lp, VirtualTime end)
    : id_(id),
      lp_count_(lp_count),
      lp_(lp),
      end_(end),
      next_time_(lp.next_time()),
      agenda_(next_time_) {}

bool TimeWarpProcess::deliver(Message&& message, Counters& counters) {
  const VirtualTime time = message.time;
  SODA_ASSERT(time >= gvt_, "message from LP ", index_of(message.source), " to LP ", index_of(id_),
              " at ", time, " behind GVT ", gvt_);
  if (!inputs_.write(std::move(message))) return false;
  if (needs_rollback(time)) ++counters.stragglers;
  const bool first = changed_from_ == kNever;
  changed_from_ = std::min(changed_from_, time);
  return first;
}

void TimeWarpProcess::settle(WorkerEffects& effects) {
  if (changed_from_ == kNever) return;
  const VirtualTime from = std::exchange(changed_from_, kNever);
  if (!faults_.empty())
    std::erase_if(faults_, [&](const FaultRecord& record) { return record.time >= from; });
  if (needs_rollback(from)) {
    roll_back(from, effects.counters);
    coast_until_ = from;
  } else {
    coast_until_ = std::min(coast_until_, from);
  }
  refresh_next_time();
  if (!pending_order_.empty()) flush_pending(effects);
}

void TimeWarpProcess::roll_back(VirtualTime to, Counters& counters) {
  const VirtualTime restart = lp_.rewind_before(first_undone(to), to);
  SODA_ASSERT(restart <= to && restart >= kept_, "LP ", index_of(id_), " rewound to ", restart,
              " for ", to, ", kept from ", kept_);
  const auto standing = static_cast<std::size_t>(
      std::lower_bound(executed_.begin(), executed_.end(), restart) - executed_.begin());
  restart_ = restart;
  ++counters.rollbacks;
  counters.rolled_back += executed_.size() - standing;
  executed_.truncate(standing);
  refresh_agenda();
  inputs_.undo(restart);
  undo_outputs(restart);
}

// The earliest executed time that is not before `to`. If there is none, the LP stands at a restart
// point later than `to`, and nothing has been executed since.
VirtualTime TimeWarpProcess::first_undone(VirtualTime to) const {
  const VirtualTime* const first = std::lower_bound(executed_.begin(), executed_.end(), to);
  return first == executed_.end() ? std::max(to, restart_) : *first;
}

void TimeWarpProcess::undo_outputs(VirtualTime from) {
  std::size_t standing = outputs_.size();
  while (standing > 0 && outputs_[standing - 1].send_time >= from) {
    Output& output = outputs_[--standing];
    slots_.release(output.id);
    pending_order_.emplace_back(output.send_time, output.id);
    pending_.emplace(output.id, PendingOutput{output.send_time, std::move(output.payload)});
  }
  outputs_.truncate(standing);
}

void TimeWarpProcess::refresh_agenda() {
  agenda_ = lp_.next_time();
  SODA_ASSERT(executed_.empty() || executed_.back() < agenda_, "agenda of LP ", index_of(id_),
              " after executing ", executed_.back(), " is ", agenda_);
}

void TimeWarpProcess::execute(WorkerEffects& effects) {
  const VirtualTime now = next_time_;
  SODA_ASSERT(now < end_ && changed_from_ == kNever, "LP ", index_of(id_), " at ", now, ", end ",
              end_);
  inputs_.gather(now, effects.bag);
  lp_.mark(now);
  Sender sender(*this, now, effects);
  lp_.execute(now, effects.bag, sender);
  executed_.push_back(now);
  ++effects.counters.executed;
  inputs_.pass(now);
  refresh_agenda();
  refresh_next_time();
  if (!pending_order_.empty()) flush_pending(effects);
}

void TimeWarpProcess::undo(VirtualTime from, WorkerEffects& effects) {
  changed_from_ = std::min(changed_from_, from);
  settle(effects);
}

// Coasts over what it undoes: sends that differ are noticed there.
void TimeWarpProcess::repeat_last(WorkerEffects& effects) {
  const VirtualTime last = executed_.back();
  const VirtualTime after_last{last.t, last.round + 1};
  const VirtualTime next = next_time_;
  const std::uint64_t digest = lp_.digest();
  roll_back(last, effects.counters);
  coast_until_ = std::max(coast_until_, after_last);
  refresh_next_time();
  coast_to(after_last, effects);
  SODA_ASSERT(next_time_ == next && lp_.digest() == digest, "LP ", index_of(id_), " executing ",
              last, " again with the same inputs gets state ", lp_.digest(), " and next time ",
              next_time_, " instead of ", digest, " and ", next,
              ": its execute is not a pure function");
}

void TimeWarpProcess::send(VirtualTime now, OutputId id, Payload payload, WorkerEffects& effects) {
  id.slot = slots_.take(id);
  if (!pending_.empty() && adopt(now, id, payload)) {
    ++effects.counters.adopted;
  } else {
    SODA_ASSERT(now >= coast_until_, "LP ", index_of(id_), " executing ", now,
                " again with the same inputs sends something else to LP ", index_of(id.destination),
                " at ", id.time, " (kind ", id.kind, ", slot ", id.slot,
                "): its execute is not a pure function");
    ++effects.counters.messages;
    effects.outgoing.push_back(
        {id.time, id_, id.destination, id.kind, id.slot, next_incarnation_++, false, payload});
  }
  outputs_.emplace_back(now, id, std::move(payload));
}

// Whether an undone execution had sent the same. Something else in the same register is forgotten
// here, for the new message will replace it at the receiver.
bool TimeWarpProcess::adopt(VirtualTime now, const OutputId& id, const Payload& payload) {
  const auto found = pending_.find(id);
  if (found == pending_.end()) return false;
  const bool same = found->second.payload == payload;
  SODA_ASSERT(!same || now >= coast_until_ || found->second.send_time == now, "LP ", index_of(id_),
              " executing ", now, " again with the same inputs sends what it sent at ",
              found->second.send_time, ": its execute is not a pure function");
  pending_.erase(found);
  return same;
}

// Cancels what was sent by undone executions at times that will not be executed again. Called
// whenever next_time_ has changed, so that an LP with nothing left to execute cancels too.
void TimeWarpProcess::flush_pending(WorkerEffects& effects) {
  while (!pending_order_.empty() && pending_order_.back().first < next_time_) {
    const auto [send_time, id] = pending_order_.back();
    pending_order_.pop_back();
    const auto found = pending_.find(id);
    if (found == pending_.end() || found->second.send_time != send_time) continue;
    SODA_ASSERT(send_time >= coast_until_, "LP ", index_of(id_), ", executed again at ", send_time,
                " with the same inputs, no longer sends kind ", id.kind, " to LP ",
                index_of(id.destination), " at ", id.time, ": its execute is not a pure function");
    SODA_ASSERT(id.time > gvt_, "LP ", index_of(id_), " cancels at ", id.time, " behind GVT ",
                gvt_);
    ++effects.counters.anti_messages;
    effects.outgoing.push_back(
        {id.time, id_, id.destination, id.kind, id.slot, next_incarnation_++, true, {}});
    pending_.erase(found);
  }
}

std::optional<CommittedFault> TimeWarpProcess::first_fault() const {
  if (faults_.empty()) return std::nullopt;
  return CommittedFault{faults_.front().time, id_, faults_.front().fault};
}

void TimeWarpProcess::coast_to(VirtualTime limit, WorkerEffects& effects) {
  while (next_time_ < limit) {
    SODA_ASSERT(next_time_ < coast_until_, "LP ", index_of(id_), " at ", next_time_, " coasts to ",
                limit, " with inputs changed from ", coast_until_);
    execute(effects);
  }
}

void TimeWarpProcess::commit(VirtualTime limit, Counters& counters) {
  const HistorySize held = history_size();
  counters.history_max =
      std::max<std::uint64_t>(counters.history_max, held.inputs + held.executed + held.outputs);
  const SlidingVector<VirtualTime>& executed = executed_;
  const VirtualTime* next = std::upper_bound(executed.begin(), executed.end(), last_committed_);
  for (; next != executed.end() && *next < limit; ++next) {
    lp_.commit(*next);
    last_committed_ = *next;
    ++counters.committed;
  }
}

void TimeWarpProcess::forget(VirtualTime gvt) {
  SODA_ASSERT(gvt >= gvt_, "GVT went back from ", gvt_, " to ", gvt);
  gvt_ = gvt;
  kept_ = lp_.forget(gvt);
  SODA_ASSERT(kept_ <= gvt, "LP ", index_of(id_), " keeps nothing before ", kept_, " at GVT ", gvt);
  const auto count_before_kept = [&](const auto& range, auto time_of) {
    std::size_t count = 0;
    while (count < range.size() && time_of(range[count]) < kept_) ++count;
    return count;
  };
  inputs_.forget(kept_, gvt_);
  executed_.drop_front(count_before_kept(executed_, [](VirtualTime time) { return time; }));
  outputs_.drop_front(count_before_kept(outputs_, [](const Output& o) { return o.send_time; }));
  // Slots are kept for as long as something may be sent to their time, which can be long after
  // the output itself has become irrevocable.
  slots_.forget(kept_);
}

TimeWarpProcess::HistorySize TimeWarpProcess::history_size() const {
  return {inputs_.size(), executed_.size(), outputs_.size() + pending_.size()};
}

}  // namespace soda::kernel
