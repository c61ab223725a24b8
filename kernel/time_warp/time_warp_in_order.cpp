// The shorter way of a TimeWarpProcess: executions in the order of time, kept in the journal.
#include <algorithm>
#include <utility>
#include <vector>

#include "kernel/api/invariant.hpp"
#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {

[[gnu::always_inline]] inline void TimeWarpProcess::send_in_order(VirtualTime now,
                                                                  const OutputId& to,
                                                                  Payload&& payload,
                                                                  WorkerEffects& effects) {
  const OutputId id{to.time, to.destination, to.kind, slots_.take(to, kept_)};
  const bool is_first = to.time > resent_until_;
  ++effects.counters.messages;
  journal_.append_output(payload);
  if (is_first && index_of(to.destination) - effects.first_own < effects.owns) {
    MessagePool& pool = inputs_.pool();
    const std::uint32_t place =
        pool.emplace(id, id_, next_version_++, false, std::move(payload), true);
    if (effects.recorder != nullptr) [[unlikely]]
      effects.recorder->sent(pool[place], now);
    effects.calendar->push(place);
  } else {
    effects.outgoing.emplace_back(id, id_, next_version_++, false, std::move(payload), is_first);
    if (effects.recorder != nullptr) [[unlikely]]
      effects.recorder->sent(effects.outgoing.back(), now);
  }
}

class TimeWarpProcess::InOrderSender final : public Outbox {
 public:
  InOrderSender(TimeWarpProcess& process, VirtualTime now, WorkerEffects& effects)
      : process_(process), now_(now), effects_(effects) {}

  void send(LpId destination, VirtualTime when, std::uint32_t kind, Payload payload) override {
    process_.check_send(now_, destination, when, kind);
    if (when >= process_.end_) return;
    try {
      process_.send_in_order(now_, {when, destination, kind, 0}, std::move(payload), effects_);
    } catch (const std::bad_alloc&) {
      end_without_memory();
    }
  }

  void fault(Fault fault) override { process_.note_fault(now_, std::move(fault)); }

 private:
  TimeWarpProcess& process_;
  const VirtualTime now_;
  WorkerEffects& effects_;
};

std::span<const MessageView> TimeWarpProcess::gather_in_order(std::uint32_t first_input,
                                                              WorkerEffects& effects) const {
  const MessagePool& pool = inputs_.pool();
  effects.bag.truncate(0);
  for (std::uint32_t place = first_input; place != MessagePool::kNone; place = pool[place].next)
    effects.bag.emplace_back(InputQueue::view(pool[place]));
  return effects.bag;
}

bool TimeWarpProcess::execute_in_order(VirtualTime now, std::uint32_t first_input,
                                       std::uint32_t inputs, WorkerEffects& effects) {
  const MessageView only = InputQueue::view(inputs_.pool()[first_input]);
  std::span<const MessageView> bag(&only, 1);
  if (inputs > 1) [[unlikely]]
    bag = gather_in_order(first_input, effects);
  const std::uint32_t state_at = journal_.next_state();
  if (saves_state())
    journal_.append_state(state_);
  else
    lp_.mark(now);
  const std::uint32_t output_at = journal_.next_output();
  InOrderSender sender(*this, now, effects);
  const std::int64_t began_ns =
      effects.recorder != nullptr ? tell_arrived(first_input, *effects.recorder) : 0;
  const bool done = run_handler(now, bag, sender);
  const std::uint32_t outputs = journal_.next_output() - output_at;
  const std::uint64_t number = journal_.next_number();
  const bool follows = last_in_order_ != 0;
  const auto back = follows ? static_cast<std::uint32_t>(number - last_in_order_) : 0;
  journal_.append({this, now.t, now.round, back, first_input, outputs, output_at, state_at});
  last_in_order_ = number;
  held_in_order_ += inputs + 1 + outputs;
  ++effects.counters.executed;
  ++effects.counters.in_order;
  if (effects.recorder != nullptr) [[unlikely]]
    effects.recorder->executed(id_, now, began_ns, false);
  inputs_.pass_over(now);
  if (!done) [[unlikely]] {
    ++effects.counters.failed;
    refresh_next_time();
    note_quiet();
    return true;
  }
  const bool is_later = note_future_event(now, lp_.next_time());
  if (!rare_) [[likely]]
    return is_later;
  note_quiet();
  return is_later || !is_quiet_;
}

void TimeWarpProcess::collect_in_order(std::uint64_t number, VirtualTime gvt,
                                       WorkerEffects& effects) {
  Counters& counters = effects.counters;
  Journal::Entry& entry = journal_[number];
  const VirtualTime time = entry.time();
  if (executed_.empty())
    counters.history_max = std::max<std::uint64_t>(counters.history_max, held_in_order_);
  else
    commit(gvt, effects);
  if (time > last_committed_) {
    lp_.commit(time);
    last_committed_ = time;
    ++counters.committed;
    if (effects.recorder != nullptr) [[unlikely]]
      effects.recorder->committed(id_, time);
  }
  gvt_ = gvt;
  forget_states(gvt);
  held_in_order_ -= 1 + entry.outputs;
  if (last_in_order_ == number) last_in_order_ = 0;
  if (kept_ <= time) [[unlikely]] {
    move_to_history(entry);
    committed_ = static_cast<std::uint32_t>(executed_.size());
  } else {
    MessagePool& pool = inputs_.pool();
    for (std::uint32_t place = entry.first_input; place != MessagePool::kNone;) {
      const std::uint32_t next = pool[place].next;
      pool.release(place);
      place = next;
      --held_in_order_;
    }
    entry.lp = nullptr;
  }
  if (!executed_.empty() || !is_quiet_) [[unlikely]] {
    drop_history(gvt);
    note_quiet();
  }
}

void TimeWarpProcess::take_all_back(Counters& counters) {
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t number = last_in_order_; journal_.has(number);) {
    const Journal::Entry& entry = journal_[number];
    if (entry.lp != this) break;
    numbers.push_back(number);
    if (entry.back == 0) break;
    number -= entry.back;
  }
  counters.taken_back += numbers.size();
  for (; !numbers.empty(); numbers.pop_back()) move_to_history(journal_[numbers.back()]);
  last_in_order_ = 0;
  held_in_order_ = 0;  // inputs, executed times and outputs
}

void TimeWarpProcess::move_to_history(Journal::Entry& entry) {
  executed_.push_back({entry.t, entry.round, entry.outputs & 0x7fff'ffffu, false});
  for (std::uint32_t i = 0; i < entry.outputs; ++i)
    outputs_.push_back(std::move(journal_.output(entry.output_at + i)));
  if (saves_state()) states_.append(journal_.state(entry.state_at), state_.size());
  const MessagePool& pool = inputs_.pool();
  for (std::uint32_t place = entry.first_input; place != MessagePool::kNone;) {
    const std::uint32_t next = pool[place].next;
    inputs_.append_executed(place);
    place = next;
    --held_in_order_;
  }
  entry.lp = nullptr;
}

}  // namespace soda::kernel
