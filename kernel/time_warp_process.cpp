#include "kernel/time_warp_process.hpp"

#include <algorithm>
#include <tuple>

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
    : id_(id), lp_count_(lp_count), lp_(lp), end_(end), next_time_(lp.next_time()) {}

bool TimeWarpProcess::deliver(Message message, Counters& counters) {
  const VirtualTime time = message.time;
  SODA_ASSERT(time >= gvt_, "message from LP ", index_of(message.source), " to LP ", index_of(id_),
              " at ", time, " behind GVT ", gvt_);
  if (!write_register(std::move(message))) return false;
  if (needs_rollback(time)) ++counters.stragglers;
  const bool first = !changed_from_;
  if (first || time < *changed_from_) changed_from_ = time;
  return first;
}

// True if that changes what a bag holds.
bool TimeWarpProcess::write_register(Message&& message) {
  Message* const at = std::lower_bound(
      inputs_.begin(), inputs_.end(), message,
      [](const auto& a, const auto& b) { return register_key(a) < register_key(b); });
  const auto index = static_cast<std::size_t>(at - inputs_.begin());
  if (at == inputs_.end() || register_key(*at) != register_key(message)) {
    // An anti-message without its message is kept: the older incarnation may still be on its way.
    const bool changes = !message.anti;
    inputs_.insert(index, std::move(message));
    if (index < next_input_) ++next_input_;
    return changes;
  }
  if (message.incarnation < at->incarnation) return false;
  SODA_ASSERT(message.incarnation != at->incarnation, "incarnation ", message.incarnation,
              " of LP ", index_of(message.source), " to LP ", index_of(id_), " at ", message.time,
              " delivered twice");
  const bool changes = message.anti != at->anti || message.payload != at->payload;
  *at = std::move(message);
  return changes;
}

void TimeWarpProcess::settle(WorkerEffects& effects) {
  if (!changed_from_) return;
  const VirtualTime from = *std::exchange(changed_from_, std::nullopt);
  std::erase_if(faults_, [&](const FaultRecord& record) { return record.time >= from; });
  if (needs_rollback(from)) {
    roll_back(from, effects.counters);
    coast_until_ = from;
  } else {
    coast_until_ = std::min(coast_until_, from);
  }
  refresh_next_time();
  flush_pending(effects);
}

void TimeWarpProcess::roll_back(VirtualTime to, Counters& counters) {
  const VirtualTime restart = lp_.rewind(to);
  SODA_ASSERT(restart <= to && restart >= kept_, "LP ", index_of(id_), " rewound to ", restart,
              " for ", to, ", kept from ", kept_);
  const auto standing = static_cast<std::size_t>(
      std::lower_bound(executed_.begin(), executed_.end(), restart) - executed_.begin());
  restart_ = restart;
  ++counters.rollbacks;
  counters.rolled_back += executed_.size() - standing;
  executed_.truncate(standing);
  next_input_ = static_cast<std::size_t>(
      std::lower_bound(inputs_.begin(), inputs_.end(), restart,
                       [](const Message& m, VirtualTime time) { return m.time < time; }) -
      inputs_.begin());
  undo_outputs(restart);
}

void TimeWarpProcess::undo_outputs(VirtualTime from) {
  std::size_t standing = outputs_.size();
  while (standing > 0 && outputs_[standing - 1].send_time >= from) {
    Output& output = outputs_[--standing];
    release_slot(output.id);
    pending_by_send_time_.emplace(output.send_time, output.id);
    pending_.emplace(output.id, PendingOutput{output.send_time, std::move(output.payload)});
  }
  outputs_.truncate(standing);
}

void TimeWarpProcess::refresh_next_time() {
  next_time_ = lp_.next_time();
  SODA_ASSERT(executed_.empty() || executed_.back() < next_time_, "agenda of LP ", index_of(id_),
              " after executing ", executed_.back(), " is ", next_time_);
  for (std::size_t i = next_input_; i < inputs_.size() && inputs_[i].time < next_time_; ++i)
    if (!inputs_[i].anti) next_time_ = inputs_[i].time;
}

void TimeWarpProcess::gather_bag(std::vector<MessageView>& bag) const {
  bag.clear();
  for (std::size_t i = next_input_; i < inputs_.size() && inputs_[i].time <= next_time_; ++i) {
    const Message& input = inputs_[i];
    if (input.anti) continue;
    bag.push_back({input.source, input.kind, input.slot, input.payload.bytes()});
  }
}

void TimeWarpProcess::execute(WorkerEffects& effects) {
  const VirtualTime now = next_time_;
  SODA_ASSERT(now < end_ && !changed_from_, "LP ", index_of(id_), " at ", now, ", end ", end_);
  gather_bag(effects.bag);
  lp_.mark(now);
  Sender sender(*this, now, effects);
  lp_.execute(now, effects.bag, sender);
  executed_.push_back(now);
  ++effects.counters.executed;
  while (next_input_ < inputs_.size() && inputs_[next_input_].time <= now) ++next_input_;
  refresh_next_time();
  flush_pending(effects);
}

void TimeWarpProcess::undo(VirtualTime from, WorkerEffects& effects) {
  if (!changed_from_ || from < *changed_from_) changed_from_ = from;
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
  id.slot = take_slot(id);
  if (adopt(now, id, payload)) {
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
  outputs_.push_back({now, id, std::move(payload)});
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
  pending_by_send_time_.erase({found->second.send_time, id});
  pending_.erase(found);
  return same;
}

// Cancels what was sent by undone executions at times that will not be executed again. Called
// whenever next_time_ has changed, so that an LP with nothing left to execute cancels too.
void TimeWarpProcess::flush_pending(WorkerEffects& effects) {
  while (!pending_by_send_time_.empty() && pending_by_send_time_.begin()->first < next_time_) {
    const auto [send_time, id] = *pending_by_send_time_.begin();
    SODA_ASSERT(send_time >= coast_until_, "LP ", index_of(id_), ", executed again at ", send_time,
                " with the same inputs, no longer sends kind ", id.kind, " to LP ",
                index_of(id.destination), " at ", id.time, ": its execute is not a pure function");
    SODA_ASSERT(id.time > gvt_, "LP ", index_of(id_), " cancels at ", id.time, " behind GVT ",
                gvt_);
    ++effects.counters.anti_messages;
    effects.outgoing.push_back(
        {id.time, id_, id.destination, id.kind, id.slot, next_incarnation_++, true, {}});
    pending_.erase(id);
    pending_by_send_time_.erase(pending_by_send_time_.begin());
  }
}

// Slots of one (time, destination, kind) are taken in the order of sending and given back in the
// reverse one, so the smallest free slot is the number in use.
std::size_t TimeWarpProcess::slot_count_index(const OutputId& id) const {
  const SlotCount* const at =
      std::lower_bound(slots_.begin(), slots_.end(), id, [](const SlotCount& a, const OutputId& b) {
        return std::tie(a.time, a.destination, a.kind) < std::tie(b.time, b.destination, b.kind);
      });
  return static_cast<std::size_t>(at - slots_.begin());
}

std::uint32_t TimeWarpProcess::take_slot(const OutputId& id) {
  const std::size_t at = slot_count_index(id);
  if (at == slots_.size() || slots_[at].time != id.time ||
      slots_[at].destination != id.destination || slots_[at].kind != id.kind)
    slots_.insert(at, {id.time, id.destination, id.kind, 0});
  return slots_[at].count++;
}

void TimeWarpProcess::release_slot(const OutputId& id) {
  SlotCount& slot = slots_[slot_count_index(id)];
  --slot.count;
  SODA_ASSERT(slot.count == id.slot, "LP ", index_of(id_), " gives back slot ", id.slot, " of ",
              slot.count + 1, " at ", id.time);
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
  const SlidingVector<VirtualTime>& executed = executed_;
  const VirtualTime* next = executed.begin();
  if (last_committed_) next = std::upper_bound(next, executed.end(), *last_committed_);
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
  const std::size_t inputs = count_before_kept(inputs_, [](const Message& m) { return m.time; });
  inputs_.drop_front(inputs);
  next_input_ -= std::min(inputs, next_input_);
  drop_annihilated();
  executed_.drop_front(count_before_kept(executed_, [](VirtualTime time) { return time; }));
  outputs_.drop_front(count_before_kept(outputs_, [](const Output& o) { return o.send_time; }));
  // Slots are kept for as long as something may be sent to their time, which can be long after
  // the output itself has become irrevocable.
  std::size_t past = 0;
  while (past < slots_.size() && slots_[past].time <= kept_) ++past;
  slots_.drop_front(past);
}

// Anti-messages behind GVT have nothing left to annihilate: an older incarnation that were still on
// its way would have held GVT back.
void TimeWarpProcess::drop_annihilated() {
  std::size_t kept = 0;
  std::size_t behind = 0;
  std::size_t dropped_executed = 0;
  for (; behind < inputs_.size() && inputs_[behind].time < gvt_; ++behind) {
    if (inputs_[behind].anti) {
      if (behind < next_input_) ++dropped_executed;
      continue;
    }
    if (kept != behind) inputs_[kept] = std::move(inputs_[behind]);
    ++kept;
  }
  if (kept == behind) return;
  inputs_.erase(kept, behind);
  next_input_ -= dropped_executed;
}

TimeWarpProcess::HistorySize TimeWarpProcess::history_size() const {
  return {inputs_.size(), executed_.size(), outputs_.size() + pending_.size()};
}

}  // namespace soda::kernel
