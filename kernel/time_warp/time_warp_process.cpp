#include "kernel/time_warp/time_warp_process.hpp"

#include <algorithm>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {

[[gnu::always_inline]] inline void TimeWarpProcess::send(VirtualTime now, const OutputId& to,
                                                         Payload&& payload,
                                                         WorkerEffects& effects) {
  const OutputId id{to.time, to.destination, to.kind, slots_.take(to, kept_)};
  if (has_pending() && adopt(now, id, payload)) {
    ++effects.counters.adopted;
    if (effects.recorder != nullptr) tell_adopted(id, now, *effects.recorder);
  } else {
    SODA_ASSERT(now >= coast_until_, "LP ", index_of(id_), " executing ", now,
                " again with the same inputs sends something else to LP ", index_of(id.destination),
                " at ", id.time, " (kind ", id.kind, ", slot ", id.slot,
                "): its execute is not a pure function");
    ++effects.counters.messages;
    effects.outgoing.emplace_back(id, id_, next_version_++, false, payload,
                                  id.time > resent_until_);
    if (effects.recorder != nullptr) effects.recorder->sent(effects.outgoing.back(), now);
  }
  outputs_.emplace_back(std::move(payload));
}

class TimeWarpProcess::Sender final : public Outbox {
 public:
  Sender(TimeWarpProcess& process, VirtualTime now, WorkerEffects& effects)
      : process_(process), now_(now), effects_(effects) {}

  void send(LpId destination, VirtualTime when, std::uint32_t kind, Payload payload) override {
    process_.check_send(now_, destination, when, kind);
    if (when >= process_.end_) return;
    try {
      process_.send(now_, {when, destination, kind, 0}, std::move(payload), effects_);
    } catch (const std::bad_alloc&) {
      end_without_memory();
    }
  }

  void cancel_eagerly(LpId to) override { process_.cancel_eagerly(now_, to, effects_); }

  void fault(Fault fault) override { process_.note_fault(now_, std::move(fault)); }

 private:
  TimeWarpProcess& process_;
  const VirtualTime now_;
  WorkerEffects& effects_;
};

TimeWarpProcess::TimeWarpProcess(LpId id, std::size_t lp_count, LogicalProcess& lp, VirtualTime end,
                                 MessagePool& pool, Journal& journal)
    : next_time_(lp.next_time()),
      inputs_(pool),
      id_(id),
      waits_(lp.waits_for_dependencies()),
      absorbs_(lp.absorbs()),
      jumps_(lp.jumps()),
      lp_(lp),
      state_(lp.state_bytes()),
      journal_(journal),
      future_event_(next_time_),
      lp_count_(static_cast<std::uint32_t>(lp_count)),
      end_(end) {
  SODA_ASSERT(next_time_ > kBeginning, "future event list of LP ", index_of(id_), " begins at ",
              next_time_, ", which is earlier than every time that can be executed");
  SODA_ASSERT(!saves_state() || !(absorbs_ || jumps_), "LP ", index_of(id_),
              " with state_bytes() absorbs or jumps");
  SODA_ASSERT(state_.size() % 8 == 0, "LP ", index_of(id_), " with ", state_.size(),
              " state_bytes()");
}

bool TimeWarpProcess::deliver_any(Message&& message, WorkerEffects& effects) {
  const VirtualTime time = message.time;
  const bool anti = message.anti;
  if (needs_rollback(time)) take_back(effects.counters);
  const bool changes = inputs_.write(std::move(message));
  if (anti) is_quiet_ = false;
  if (!changes) return false;
  if (jumps_ && (has_undone() || (needs_rollback(time) && !absorbs_)))
    rare().different.push_back(time);
  if (needs_rollback(time)) {
    ++effects.counters.stragglers;
    if (absorbs_) {
      rare().changed.push_back(time);
      return changed_from_ == kNever && rare_->changed.size() == 1;
    }
  } else if (!anti && changed_from_ == kNever && !has_fault()) {
    note_input(time);
    return false;
  }
  const bool first = changed_from_ == kNever;
  changed_from_ = std::min(changed_from_, time);
  is_quiet_ = false;
  return first;
}

void TimeWarpProcess::settle(WorkerEffects& effects) {
  if (effects.recorder != nullptr) effects.recorder->settled(id_);
  if (absorbs_ && rare_ && !rare_->changed.empty()) absorb_changes(effects);
  if (changed_from_ == kNever) return note_quiet();
  const VirtualTime from = std::exchange(changed_from_, kNever);
  if (has_fault()) {
    if (jumps_)
      for (const FaultRecord& record : rare_->faults)
        if (record.time >= from) rare_->different.push_back(record.time);
    std::erase_if(rare_->faults, [&](const FaultRecord& record) { return record.time >= from; });
  }
  if (needs_rollback(from)) {
    take_back(effects.counters);
    roll_back(from, effects);
    coast_until_ = from;
    if (waits_)
      for (const LpId lp : lp_.eager_cancellations()) cancel_eagerly(from, lp, effects);
  } else {
    coast_until_ = std::min(coast_until_, from);
  }
  refresh_next_time();
  if (has_pending()) flush_pending(effects);
  note_quiet();
}

// Of the changes behind the LP, the first that cannot be absorbed is left.
void TimeWarpProcess::absorb_changes(WorkerEffects& effects) {
  std::vector<VirtualTime>& changed = rare().changed;
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  for (const VirtualTime time : changed) {
    if (absorb(time, effects)) continue;
    changed_from_ = std::min(changed_from_, time);
    if (jumps_) rare_->different.insert(rare_->different.end(), changed.begin(), changed.end());
    break;
  }
  changed.clear();
}

// The bag counts as executed. If nothing is left of it, there is nothing to execute, unless the
// future event list asks for it: then the LP has to go back to where it had not executed it.
bool TimeWarpProcess::absorb(VirtualTime time, WorkerEffects& effects) {
  inputs_.gather_passed(time, effects.bag);
  const std::size_t at = executed_before(time);
  const bool is_executed = at < executed_.size() && executed_[at].time() == time;
  const bool asks = !effects.bag.empty() || (is_executed && executed_[at].is_future_event);
  rare_->has_refused = asks && !failed_ && !lp_.absorb(time, effects.bag);
  if (!asks) return !is_executed;
  if (failed_ || rare_->has_refused) return false;
  ++effects.counters.absorbed;
  if (effects.recorder != nullptr) effects.recorder->absorbed(id_, time, !is_executed);
  if (next_time_ < coast_until_) stop_coasting(time);
  if (is_executed) return true;
  executed_.insert(at, {time.t, time.round, 0, false});
  ++effects.counters.executed;
  effects.revalidated.push_back(time);
  return true;
}

// What has not been executed again may come out differently: an input at `time` has changed.
void TimeWarpProcess::stop_coasting(VirtualTime time) {
  coast_until_ = std::min(coast_until_, time);
  std::erase_if(rare_->faults, [&](const FaultRecord& fault) { return fault.time >= next_time_; });
}

// How many of executed_ have a time < `time`.
std::size_t TimeWarpProcess::executed_before(VirtualTime time) const {
  const Executed* const end =
      std::lower_bound(executed_.begin(), executed_.end(), time,
                       [](const Executed& executed, VirtualTime t) { return executed.time() < t; });
  return static_cast<std::size_t>(end - executed_.begin());
}

void TimeWarpProcess::roll_back(VirtualTime to, WorkerEffects& effects) {
  const bool was_as_before = has_undone() && !failed_ && lp_.is_as_before();
  const VirtualTime restart = saves_state() ? to : lp_.rewind_before(first_undone(to), to);
  SODA_ASSERT(restart <= to && restart >= kept_, "LP ", index_of(id_), " rewound to ", restart,
              " for ", to, ", kept from ", kept_);
  const std::size_t standing = executed_before(restart);
  ++effects.counters.rollbacks;
  effects.counters.rolled_back += executed_.size() - standing;
  if (effects.recorder != nullptr) tell_undone(standing, restart, to, *effects.recorder);
  if (jumps_) note_undone(standing, was_as_before);
  for (std::size_t i = executed_.size(); i > standing; --i) undo_outputs(executed_[i - 1]);
  if (saves_state()) restore_state(standing, to);
  if (!saves_state()) restarted_at_ = restart;
  executed_.truncate(standing);
  failed_ = false;
  committed_ = std::min(committed_, static_cast<std::uint32_t>(standing));
  refresh_future_event();
  inputs_.undo(restart);
}

// To what it was before executed_[at], the first that is not before `to`, if there is one.
void TimeWarpProcess::restore_state(std::size_t at, VirtualTime to) {
  if (at < executed_.size()) {
    const std::size_t first = at * state_.size();
    std::copy_n(states_.begin() + first, state_.size(), state_.begin());
    states_.truncate(first);
  }
  lp_.rewound(to);
}

// The earliest executed time that is not before `to`. If there is none, the LP stands at a restart
// point later than `to`, and nothing has been executed since.
VirtualTime TimeWarpProcess::first_undone(VirtualTime to) const {
  const std::size_t first = executed_before(to);
  return first == executed_.size() ? std::max(to, inputs_.boundary()) : executed_[first].time();
}

// The latest of what stands.
void TimeWarpProcess::undo_outputs(const Executed& undone) {
  if (undone.outputs == 0) return;
  Rare& undo = rare();
  for (std::uint32_t i = 0; i < undone.outputs; ++i) {
    const OutputId id = slots_.release(kept_);
    resent_until_ = std::max(resent_until_, id.time);
    undo.pending_order.emplace_back(undone.time(), id);
    undo.pending.emplace(id, PendingOutput{undone.time(), std::move(outputs_.back())});
    outputs_.truncate(outputs_.size() - 1);
  }
}

void TimeWarpProcess::execute(WorkerEffects& effects) {
  const VirtualTime now = next_time_;
  SODA_ASSERT(now < end_ && changed_from_ == kNever, "LP ", index_of(id_), " at ", now, ", end ",
              end_);
  take_back(effects.counters);
  const std::uint32_t passed = inputs_.gather(now, effects.bag);
  if (saves_state())
    states_.append(state_.data(), state_.size());
  else
    lp_.mark(now);
  const std::size_t sent_before = outputs_.size();
  Sender sender(*this, now, effects);
  const bool is_future_event = future_event_ == now;
  const std::int64_t began_ns = effects.recorder != nullptr ? effects.recorder->now_ns() : 0;
  const bool done = run_handler(now, effects.bag, sender);
  const auto sent = static_cast<std::uint32_t>(outputs_.size() - sent_before);
  executed_.push_back({now.t, now.round, sent & 0x7fff'ffffu, is_future_event});
  ++effects.counters.executed;
  if (effects.recorder != nullptr) [[unlikely]]
    effects.recorder->executed(id_, now, began_ns, now < coast_until_);
  effects.counters.coasted += now < coast_until_;
  inputs_.pass(now, passed);
  if (done) [[likely]]
    refresh_future_event();
  else
    ++effects.counters.failed;
  refresh_next_time();
  if (!rare_ && is_quiet_) return;
  if (has_pending()) flush_pending(effects);
  note_quiet();
  if (!has_undone()) return;
  drop_replaced(now);
  if (done && next_time_ >= coast_until_ && has_undone() && lp_.is_as_before()) jump(effects);
}

// What coasts has all that it had.
bool TimeWarpProcess::waits_for_messages(WorkerEffects& effects) const {
  if (next_time_ >= end_ || next_time_ < coast_until_) return false;
  inputs_.gather(next_time_, effects.bag);
  return lp_.holds(next_time_, effects.bag);
}

void TimeWarpProcess::undo(VirtualTime from, WorkerEffects& effects) {
  changed_from_ = std::min(changed_from_, from);
  settle(effects);
}

// Coasts over what it undoes: sends that differ are noticed there.
void TimeWarpProcess::repeat_last(WorkerEffects& effects) {
  if (failed_) return;
  take_back(effects.counters);
  const VirtualTime last = executed_.back().time();
  const VirtualTime after_last{last.t, last.round + 1};
  const VirtualTime next = next_time_;
  const std::uint64_t digest = lp_.digest();
  roll_back(last, effects);
  coast_until_ = std::max(coast_until_, after_last);
  refresh_next_time();
  coast_to(after_last, effects);
  SODA_ASSERT(next_time_ == next && lp_.digest() == digest, "LP ", index_of(id_), " executing ",
              last, " again with the same inputs gets state ", lp_.digest(), " and next time ",
              next_time_, " instead of ", digest, " and ", next,
              ": its execute is not a pure function");
}

// Whether an undone execution had sent the same. Something else of the same message id is forgotten
// here, for the new message will replace it at the receiver.
bool TimeWarpProcess::adopt(VirtualTime now, const OutputId& id, const Payload& payload) {
  auto& pending = rare_->pending;
  const auto found = pending.find(id);
  if (found == pending.end()) return false;
  const bool same = found->second.payload == payload;
  SODA_ASSERT(!same || now >= coast_until_ || found->second.send_time == now, "LP ", index_of(id_),
              " executing ", now, " again with the same inputs sends what it sent at ",
              found->second.send_time, ": its execute is not a pure function");
  pending.erase(found);
  return same;
}

// Cancels what was sent by undone executions at times that will not be executed again. Called
// whenever next_time_ has changed, so that an LP with nothing left to execute cancels too.
void TimeWarpProcess::flush_pending(WorkerEffects& effects) {
  auto& pending = rare_->pending;
  auto& order = rare_->pending_order;
  while (!order.empty() && order.back().first < next_time_) {
    const auto [send_time, id] = order.back();
    order.pop_back();
    const auto found = pending.find(id);
    if (found == pending.end() || found->second.send_time != send_time) continue;
    SODA_ASSERT(send_time >= coast_until_, "LP ", index_of(id_), ", executed again at ", send_time,
                " with the same inputs, no longer sends kind ", id.kind, " to LP ",
                index_of(id.destination), " at ", id.time, ": its execute is not a pure function");
    cancel(id, effects);
    pending.erase(found);
  }
}

void TimeWarpProcess::cancel(const OutputId& id, WorkerEffects& effects) {
  SODA_ASSERT(id.time > gvt_, "LP ", index_of(id_), " cancels at ", id.time, " behind GVT ", gvt_);
  ++effects.counters.anti_messages;
  effects.outgoing.push_back({id, id_, next_version_++, true, {}});
  if (effects.recorder != nullptr) effects.recorder->sent(effects.outgoing.back(), kBeginning);
}

void TimeWarpProcess::cancel_eagerly(VirtualTime now, LpId destination, WorkerEffects& effects) {
  if (!rare_ || now < coast_until_) return;
  for (auto item = rare_->pending.begin(); item != rare_->pending.end();) {
    const auto& [id, output] = *item;
    if (id.destination != destination || output.send_time <= now) {
      ++item;
      continue;
    }
    cancel(id, effects);
    ++effects.counters.withdrawn;
    item = rare_->pending.erase(item);
  }
}

void TimeWarpProcess::coast_to(VirtualTime limit, WorkerEffects& effects) {
  while (next_time_ < limit) {
    SODA_ASSERT(next_time_ < coast_until_, "LP ", index_of(id_), " at ", next_time_, " coasts to ",
                limit, " with inputs changed from ", coast_until_);
    execute(effects);
  }
}

void TimeWarpProcess::commit(VirtualTime limit, WorkerEffects& effects) {
  Counters& counters = effects.counters;
  const HistorySize held = history_size();
  counters.history_max = std::max<std::uint64_t>(
      counters.history_max, held.inputs + held.executed + held.outputs + held_in_order_);
  const Executed* executed = executed_.begin() + committed_;
  for (; executed != executed_.end(); ++executed) {
    const VirtualTime time = executed->time();
    if (time >= limit) break;
    if (time <= last_committed_) continue;  // executed again
    lp_.commit(time);
    last_committed_ = time;
    ++counters.committed;
    if (effects.recorder != nullptr) effects.recorder->committed(id_, time);
  }
  committed_ = static_cast<std::uint32_t>(executed - executed_.begin());
}

void TimeWarpProcess::forget(VirtualTime gvt) {
  SODA_ASSERT(gvt >= gvt_, "GVT went back from ", gvt_, " to ", gvt);
  gvt_ = gvt;
  forget_states(gvt);
  drop_history(gvt);
  note_quiet();
}

// Before kept_.
void TimeWarpProcess::drop_history(VirtualTime gvt) {
  const VirtualTime kept = kept_;
  inputs_.forget(kept, gvt);
  const Executed* executed = executed_.begin();
  std::size_t outputs = 0;
  for (; executed != executed_.end() && executed->time() < kept; ++executed)
    outputs += executed->outputs;
  if (executed == executed_.begin()) return;
  const auto count = static_cast<std::uint32_t>(executed - executed_.begin());
  // What the LP has been rewound behind is committed when it has been executed again.
  SODA_ASSERT(count <= committed_, "LP ", index_of(id_), " forgets before ", kept,
              " what it has not committed, after ", last_committed_);
  executed_.drop_front(count);
  committed_ -= count;
  outputs_.drop_front(outputs);
  states_.drop_front(count * state_.size());
}

TimeWarpProcess::HistorySize TimeWarpProcess::history_size() const {
  return {inputs_.size(), executed_.size(), outputs_.size() + (rare_ ? rare_->pending.size() : 0)};
}

}  // namespace soda::kernel
