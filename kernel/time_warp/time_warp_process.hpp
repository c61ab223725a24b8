// One logical process under Time Warp: its inputs, history and outputs, rollback and lazy
// cancellation. Knows neither threads nor GVT computation: an executor drives it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernel/api/event_recorder.hpp"
#include "kernel/api/executor.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/api/logical_process.hpp"
#include "kernel/api/message.hpp"
#include "kernel/api/virtual_time.hpp"
#include "kernel/queues/input_queue.hpp"
#include "kernel/queues/message_calendar.hpp"
#include "kernel/queues/sliding_vector.hpp"
#include "kernel/queues/slot_table.hpp"
#include "kernel/time_warp/journal.hpp"

namespace soda::kernel {

// What the calls of one worker's processes write to.
struct WorkerEffects {
  std::vector<Message> outgoing;  // to be delivered by the executor, in any order
  // Where first versions for LPs first_own .. first_own + owns - 1 may go instead, if it is
  // known that they come into the receiver's hands before it executes their time or later.
  MessageCalendar* calendar = nullptr;
  std::uint32_t first_own = 0;
  std::uint32_t owns = 0;
  Counters counters;
  EventRecorder* recorder = nullptr;  // of what happens; or null
  SlidingVector<MessageView> bag;     // scratch
  // Times that count as executed though they were not: bags absorbed, and what a jump put back in
  // force. The executor clears it.
  std::vector<VirtualTime> revalidated;
};

// Driving: deliver() any number of messages, then settle(); execute() while next_time() is within
// the window; after every GVT, commit() and then forget(). All other methods need a settled
// process.
//
// Most executions are never undone, and most messages come in time. For these there is a shorter
// way: the executor keeps the messages until their time has come, and hands them over for
// execute_in_order(). What that leaves behind lies in the executor's journal until
// collect_in_order(); whatever concerns it, a late message or execute(), takes it back into the
// LP's own history first.
//
// Jefferson's Time Warp (ACM TOPLAS 7, 1985) with lazy cancellation, messages with ids and versions
// (message.hpp) and restart points that the LP chooses. What is true between calls:
//  1. Every input before coast_until is as it was when the times before it were last executed. So
//     where the LP is behind coast_until (it coasts), its outputs up to there will come out as they
//     were, and the floor is coast_until, not next_time.
//  2. Pending outputs (sent by executions that were undone) have send time >= next_time. Those that
//     an anti-message may still be needed for have send time >= floor, so receive time > floor.
class alignas(64) TimeWarpProcess {
 public:
  // `lp`, `pool` and `journal` must outlive the process. Times >= end are never executed nor sent
  // to.
  TimeWarpProcess(LpId id, std::size_t lp_count, LogicalProcess& lp, VirtualTime end,
                  MessagePool& pool, Journal& journal);

  LpId id() const { return id_; }

  // The earliest time it has something to execute at: its future event list or a bag. >= end if
  // nothing.
  VirtualTime next_time() const { return next_time_; }

  // Lower bound of the times of all messages it may still send, less one; what GVT is the minimum
  // of.
  VirtualTime floor() const { return next_time_ > coast_until_ ? next_time_ : coast_until_; }

  bool waits_for_dependencies() const { return waits_; }
  // Whether the LP waits at next_time() for messages that GVT has not excluded yet (dependency
  // waits). It has a floor all the same.
  bool holds(VirtualTime gvt, WorkerEffects& effects) const {
    return waits_ && next_time_ > gvt && waits_for_messages(effects);
  }

  // Takes in a message, of time >= the last GVT. True if settle() must follow before anything else;
  // if not, next_time() and floor() may have changed already.
  bool deliver(Message&& message, WorkerEffects& effects);

  // Rolls back if what was delivered since the last call changed a time that has been executed;
  // cancels what thereby can no longer be sent again.
  void settle(WorkerEffects& effects);

  // Executes next_time(), which must be < end.
  void execute(WorkerEffects& effects);

  // Whether it executes in order at all: nothing but its messages decides about that.
  bool is_plain() const { return !waits_ && !absorbs_ && !jumps_; }

  // Whether nothing stands against execute_in_order(now, ...).
  bool takes_in_order(VirtualTime now) const {
    return is_quiet_ && inputs_.boundary() <= now && now < next_time_;
  }

  // Executes `now` < end with `inputs` > 0 messages of that time, linked in canonical order from
  // `first_input`: none of them an anti-message, and no other of that time has been delivered.
  // takes_in_order(now) must be true. True if next_time() has changed or it is not quiet any more.
  bool execute_in_order(VirtualTime now, std::uint32_t first_input, std::uint32_t inputs,
                        WorkerEffects& effects);

  // Commits the first entry of this LP in the journal, of a time < gvt, and takes it out.
  void collect_in_order(std::uint64_t number, VirtualTime gvt, WorkerEffects& effects);

  // Takes all entries of this LP out of the journal into its own history.
  void take_back(Counters& counters) {
    if (last_in_order_ != 0) [[unlikely]]
      take_all_back(counters);
  }

  // Rolls back to `from`, as if a straggler had come: for tests of rollback under any schedule.
  // `from` must be >= every GVT that has been or is being computed.
  void undo(VirtualTime from, WorkerEffects& effects);

  // Purity check: executes the last executed time again, with the same inputs. Aborts unless the
  // outputs, the next time and the digest of the LP come out as they were.
  void repeat_last(WorkerEffects& effects);

  // The earliest fault of an execution that stands, or that will come out again after coasting.
  std::optional<CommittedFault> first_fault() const;

  bool has_fault() const { return rare_ && !rare_->faults.empty(); }

  // Executes again what is undone before `limit`, which is <= floor(). Sends nothing new.
  void coast_to(VirtualTime limit, WorkerEffects& effects);

  // Commits what has been executed before `limit` (<= GVT) and not been committed yet.
  void commit(VirtualTime limit, WorkerEffects& effects);

  // Whether commit() and forget() have nothing left to do until it executes again.
  bool is_committed() const {
    return executed_.empty() || executed_.back().time() <= last_committed_;
  }

  // The earliest time that commit() or forget() may have something to do for, but for what lies in
  // the journal; kNever if there is none.
  VirtualTime uncommitted_from() const {
    const VirtualTime anti = has_antis() ? inputs_.first_anti() : kNever;
    return committed_ == executed_.size() ? anti : std::min(anti, executed_[committed_].time());
  }

  // Fossil collection: drops what no rollback to `gvt` or later needs.
  void forget(VirtualTime gvt);

  // Both, before it executes: then what they touch is needed anyway. Only if there is enough to
  // collect to be worth it. Nothing may fail before `gvt`.
  void collect(VirtualTime gvt, WorkerEffects& effects) {
    const bool is_enough = executed_.size() > kFewFossils && executed_[kFewFossils].time() <= gvt;
    if (!is_enough && !(restarted_at_ > kBeginning && gvt_ < gvt)) return;
    commit(gvt, effects);
    forget(gvt);
  }
  // Whether there are annihilated messages: forget() drops them, though nothing is executed any
  // more.
  bool has_antis() const { return inputs_.has_antis(); }

  // Hints that it will be executed soon: first fetches the process itself into the cache, then,
  // called later, what it refers to. Always inline: GCC 12 takes a function that only fetches for
  // one without effect, and drops calls of it.
  [[gnu::always_inline]] void prefetch() const {
    const char* const line = reinterpret_cast<const char*>(this);
#pragma GCC unroll 8
    for (std::size_t at = 0; at < sizeof *this; at += 64) __builtin_prefetch(line + at);
  }
  [[gnu::always_inline]] void prefetch_lp() const {
    const char* const lp = reinterpret_cast<const char*>(&lp_);
    __builtin_prefetch(lp);
    __builtin_prefetch(lp + 64);
  }
  [[gnu::always_inline]] void prefetch_in_order() const {
    prefetch_lp();
    slots_.prefetch();
  }
  [[gnu::always_inline]] void prefetch_history() const {
    prefetch_lp();
    __builtin_prefetch(executed_.end());
    __builtin_prefetch(outputs_.end());
    inputs_.prefetch();
  }

  // As many executed times may be left to the next collect().
  static constexpr std::size_t kFewFossils = 1;

  // Entries held, for the bound on memory: inputs, executed times, outputs.
  struct HistorySize {
    std::size_t inputs = 0;
    std::size_t executed = 0;
    std::size_t outputs = 0;
  };
  HistorySize history_size() const;

 private:
  class Sender;         // the outbox of one execution
  class InOrderSender;  // and of one in order
  struct Executed {
    std::int64_t t = 0;
    std::uint32_t round = 0;
    std::uint32_t outputs : 31 = 0;  // how many it sent
    // Whether the LP's future event list asked for it, so that it stands without a message.
    bool is_future_event : 1 = false;

    VirtualTime time() const { return {t, round}; }
  };
  static_assert(sizeof(Executed) == 16);
  struct PendingOutput {
    VirtualTime send_time;
    Payload payload;
  };
  struct FaultRecord {
    VirtualTime time;
    Fault fault;
  };
  // What an LP that is never rolled back and never fails does without.
  struct Rare {
    std::vector<FaultRecord> faults;  // ascending; see first_fault()
    std::map<OutputId, PendingOutput> pending;
    // What became pending, latest send time first. Entries that are no longer in `pending` are
    // overtaken: ignore them.
    std::vector<std::pair<VirtualTime, OutputId>> pending_order;
    // Undone executions, latest first, and the times since then at which they would not come out as
    // they did: for jumps, if the LP jumps().
    std::vector<Executed> undone;
    std::vector<VirtualTime> different;
    std::vector<VirtualTime> changed;  // since settle(), behind the LP, if it absorbs
    bool has_refused = false;          // to absorb the last of them
  };

  // Whether a change at `time` makes the LP's state wrong: it has executed that time, or it stands
  // at a restart point later than that and would execute `time` from there.
  bool needs_rollback(VirtualTime time) const { return time < inputs_.boundary(); }
  Rare& rare() {
    if (!rare_) rare_ = std::make_unique<Rare>();
    return *rare_;
  }
  bool has_pending() const { return rare_ && !rare_->pending_order.empty(); }
  bool deliver_any(Message&& message, WorkerEffects& effects);
  bool deliver_recorded(Message&& message, WorkerEffects& effects);
  // Of the usual kind: nothing that has been executed is concerned, and nothing gets later, so
  // nothing can be left to cancel.
  void note_input(VirtualTime time) {
    if (time < coast_until_) coast_until_ = time;
    if (time < next_time_) next_time_ = time;
  }
  void absorb_changes(WorkerEffects& effects);
  bool absorb(VirtualTime time, WorkerEffects& effects);
  bool has_undone() const { return rare_ && !rare_->undone.empty(); }
  void note_undone(std::size_t standing, bool was_as_before);
  void drop_replaced(VirtualTime now);
  void jump(WorkerEffects& effects);
  VirtualTime end_of_restorable() const;
  bool run_handler(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox);
  void note_failure(VirtualTime now);
  void restore(const Executed& record, WorkerEffects& effects);
  void stop_coasting(VirtualTime time);
  bool waits_for_messages(WorkerEffects& effects) const;
  std::size_t executed_before(VirtualTime time) const;
  void roll_back(VirtualTime to, WorkerEffects& effects);
  void tell_adopted(const OutputId& id, VirtualTime now, EventRecorder& recorder) const;
  void tell_undone(std::size_t standing, VirtualTime restart, VirtualTime changed,
                   EventRecorder& recorder) const;
  VirtualTime first_undone(VirtualTime to) const;
  void undo_outputs(const Executed& undone);
  void refresh_next_time() {
    next_time_ = failed_ ? kNever : std::min(future_event_, inputs_.next_time());
  }
  // What the LP says after it has executed `now` in order, of which the inputs know nothing.
  bool note_future_event(VirtualTime now, VirtualTime next) {
    if (next == future_event_) return false;  // it was later than `now`, as next_time_ was
    SODA_ASSERT(now < next, "future event list of LP ", index_of(id_), " after executing ", now,
                " is ", next);
    future_event_ = next;
    const VirtualTime before = next_time_;
    refresh_next_time();
    return next_time_ != before;
  }
  void refresh_future_event() {
    future_event_ = lp_.next_time();
    SODA_ASSERT(executed_.empty() || executed_.back().time() < future_event_,
                "future event list of LP ", index_of(id_), " after executing ",
                executed_.back().time(), " is ", future_event_);
  }
  void check_send(VirtualTime now, LpId destination, VirtualTime when, std::uint32_t kind) const {
    SODA_ASSERT(when > now, "LP ", index_of(id_), " executing ", now, " sends kind ", kind,
                " to LP ", index_of(destination), " at ", when,
                ", which is not later than its own time");
    SODA_ASSERT(index_of(destination) < lp_count_, "LP ", index_of(id_), " at ", now,
                " sends to LP ", index_of(destination), " of ", lp_count_);
  }
  void note_fault(VirtualTime now, Fault fault);
  [[noreturn]] static void end_without_memory();
  void send(VirtualTime now, const OutputId& to, Payload&& payload, WorkerEffects& effects);
  bool adopt(VirtualTime now, const OutputId& id, const Payload& payload);
  void flush_pending(WorkerEffects& effects);
  std::span<const MessageView> gather_in_order(std::uint32_t first_input,
                                               WorkerEffects& effects) const;
  void send_in_order(VirtualTime now, const OutputId& to, Payload&& payload,
                     WorkerEffects& effects);
  std::int64_t tell_arrived(std::uint32_t first_input, EventRecorder& recorder) const;
  void take_all_back(Counters& counters);
  void move_to_history(Journal::Entry& entry);
  void drop_history(VirtualTime gvt);
  // Whether the executor saves the state, so that the LP can restart at any time.
  bool saves_state() const { return !state_.empty(); }
  void restore_state(std::size_t at, VirtualTime to);
  // Lets the LP forget what no rollback to `gvt` or later needs.
  void forget_states(VirtualTime gvt) {
    kept_ = gvt;
    if (saves_state()) return;
    kept_ = lp_.forget(gvt);
    if (restarted_at_ < kept_) restarted_at_ = kBeginning;
    SODA_ASSERT(kept_ <= gvt, "LP ", index_of(id_), " keeps nothing before ", kept_, " at GVT ",
                gvt);
  }
  void note_quiet() {
    is_quiet_ = !inputs_.has_antis() && changed_from_ == kNever &&
                coast_until_ <= inputs_.boundary() &&
                (!rare_ ||
                 (rare_->faults.empty() && rare_->pending_order.empty() && rare_->pending.empty()));
  }
  void cancel_eagerly(VirtualTime now, LpId destination, WorkerEffects& effects);
  void cancel(const OutputId& id, WorkerEffects& effects);

  // What a message to come needs, then what an execution needs beside that.
  VirtualTime next_time_;
  VirtualTime coast_until_ = kBeginning;
  VirtualTime gvt_ = kBeginning;
  VirtualTime changed_from_ = kNever;  // earliest change delivered since settle()
  InputQueue inputs_;
  std::unique_ptr<Rare> rare_;
  const LpId id_;
  const bool waits_, absorbs_, jumps_;
  bool is_quiet_ = true;         // not rolling back, coasting, cancelling or faulty
  std::uint32_t committed_ = 0;  // executed_ up to here has been committed
  LogicalProcess& lp_;
  const std::span<std::byte> state_;  // of the LP, if the executor saves it
  Journal& journal_;
  std::uint64_t last_in_order_ = 0;          // its last entry in the journal; 0: none
  std::uint32_t held_in_order_ = 0;          // inputs, executed times and outputs there
  SlidingVector<Executed> executed_;         // ascending
  VirtualTime last_committed_ = kBeginning;  // outlives rollbacks behind it
  SlidingVector<std::byte> states_;          // before each of executed_, if it saves the state
  SlidingVector<Payload> outputs_;           // standing, as sent by what has been executed
  std::uint64_t next_version_ = 1;
  VirtualTime resent_until_ = kBeginning;  // what was sent up to there may have been undone
  SlotTable slots_;                        // of what stands and of what is irrevocable
  VirtualTime future_event_;               // of the LP
  const std::uint32_t lp_count_;
  bool failed_ = false;  // an exception left the last execution: nothing follows it
  const VirtualTime end_;
  VirtualTime kept_ = kBeginning;  // no restart is earlier than that
  // Where the LP stood after its last rollback. Until GVT has left that, it may hold checkpoints of
  // times that it executes no more, beside those of executed_.
  VirtualTime restarted_at_ = kBeginning;
};

inline bool TimeWarpProcess::deliver(Message&& message, WorkerEffects& effects) {
  SODA_ASSERT(message.time >= gvt_, "message from LP ", index_of(message.source), " to LP ",
              index_of(id_), " at ", message.time, " behind GVT ", gvt_);
  const VirtualTime time = message.time;
  if (effects.recorder != nullptr) [[unlikely]]
    return deliver_recorded(std::move(message), effects);
  if (needs_rollback(time) || message.anti || rare_ || changed_from_.t != kNever.t) [[unlikely]]
    return deliver_any(std::move(message), effects);
  if (inputs_.write(std::move(message))) note_input(time);
  return false;
}

// False if an exception left it, which is then a fault of `now`. What was executed before came out
// well, so an exception of a repetition is not the model's.
[[gnu::always_inline]] inline bool TimeWarpProcess::run_handler(VirtualTime now,
                                                                std::span<const MessageView> bag,
                                                                Outbox& outbox) {
  try {
    lp_.execute(now, bag, outbox);
    return true;
  } catch (const EndsRun&) {
    throw;
  } catch (...) {
    if (now < coast_until_) throw;
    note_failure(now);
    return false;
  }
}

}  // namespace soda::kernel
