// One worker thread of a Time Warp executor: the LPs it owns and the loop that drives them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/api/hash_mix.hpp"
#include "kernel/executors/worker_clock.hpp"
#include "kernel/executors/worker_group.hpp"
#include "kernel/queues/lp_heap.hpp"
#include "kernel/queues/message_calendar.hpp"
#include "kernel/time_warp/journal.hpp"
#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {

class Worker {
 public:
  // Worker `index` of the worker group. LP i of the whole run is lps[i].
  Worker(std::size_t index, WorkerGroup& group,
         std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
         const ThreadsOptions& options, const ProgressFn& progress);

  // Returns when GVT has reached the end or a fault, or the run was to stop or given up.
  void run();

  const Counters& counters() const { return effects_.counters; }
  const EventCounts& kinds() const { return recorder_.counts(); }
  // Until `end`, when the worker group's run ended; if the run accounts for its time.
  TimeAccount account(WorkerClock::Point end);
  const std::optional<CommittedFault>& fault() const { return fault_; }
  // The stop request that ended the run at gvt(), before its end; else 0.
  std::uint32_t stopped() const { return stopped_; }
  VirtualTime gvt() const { return gvt_; }

 private:
  void take_in_messages();
  void execute_batch();
  void hand_over_messages();
  void take_part_in_round();
  void wait_for_work();

  bool asks_external() const { return external_.exists(); }
  VirtualTime take_external(const GvtOutcome& outcome);
  void exchange_with_other_ranks();
  void deliver_arrived();
  void deliver(std::uint32_t own, Message&& message);
  void deliver_now(std::uint32_t own, Message&& message);
  void settle_receivers();
  void release_held_back();
  void route_outgoing();
  void refresh(std::uint32_t own);
  void schedule(std::uint32_t own) {
    if (processes_[own].waits_for_dependencies()) [[unlikely]]
      schedule_waits(own);
    else
      schedule_.update(own, processes_[own].floor());
  }
  void schedule_waits(std::uint32_t own);
  void note_lead(std::int64_t t);
  bool reopen();
  // Whether GVT is the earliest floor of its LPs, now and without a round: nobody else can send.
  bool knows_gvt() const { return is_alone_ && held_.empty() && may_be_faulty_.empty(); }
  void release_reached();
  // When a round has to look at the LP's history. So a round costs as much as it commits, and not
  // what others hold that GVT has not passed.
  void note_uncommitted(std::uint32_t own) {
    const VirtualTime from = processes_[own].uncommitted_from();
    if (from < uncommitted_.time_of(own)) uncommitted_.update(own, from);
  }
  std::uint32_t pick();
  VirtualTime earliest() { return std::min(schedule_.top_time(), calendar_.top_time()); }
  void execute_one(std::uint32_t own);
  bool precedes_schedule(VirtualTime now) const;
  std::size_t execute_arrived(std::size_t most);
  bool execute_bag(VirtualTime now);
  std::uint32_t take_rest(VirtualTime now, LpId lp, std::uint32_t first);
  void deliver_list(std::uint32_t own, std::uint32_t first);
  void collect_journal();
  void take_back_journal();
  void adapt_batch(std::size_t executed);
  GvtReport make_report();
  void note_gvt(VirtualTime gvt);
  void commit(const GvtOutcome& outcome);
  void finish(VirtualTime limit);
  void coast_to(VirtualTime limit);
  void request_round(std::uint64_t Counters::*reason);
  void wake_others();
  std::size_t bags_per_round() const;
  // It may not run away from the others while they make up GVT: their messages would come late.
  bool is_far_ahead() const {
    return gvt_part_.awaits_outcome() && executed_since_report_ >= bags_per_round();
  }
  VirtualTime end_of_window() const;
  bool follows_work() const { return options_.window == kWindowByWork; }
  bool can_execute() { return earliest() < open_until_ || reopen(); }
  bool shuffles() const { return options_.scheduling_seed != 0; }
  // Whether it is the one that speaks with the other ranks.
  bool communicates() const { return group_.link != nullptr && index_ == 0; }

  // The communicating worker of a rank cannot be woken from outside. It naps, longer while nothing
  // happens: ranks that share processors would take them from each other by looking all the time.
  static constexpr std::chrono::microseconds kShortestNap{10}, kLongestNap{300};
  // Other ranks may wait for this one's part in GVT, and cannot tell: it takes part at least so
  // often. One that works longer at a time looks after that, too, or each step of the computation
  // would take as long as two of its batches.
  static constexpr std::chrono::microseconds kLongestBetweenRounds{300};

  const std::size_t index_;
  WorkerGroup& group_;
  const VirtualTime end_;
  const ThreadsOptions options_;
  const ProgressFn& progress_;
  ExternalSourceDoor external_;  // of one worker of all
  // To the reduction that is under way, by this rank.
  VirtualTime contributed_ = kBeginning;
  std::chrono::steady_clock::time_point contributed_at_{};
  const std::uint32_t first_lp_;
  const bool holds_back_;  // messages, at random; in lockstep nothing may be late
  const bool is_alone_;    // nobody else sends or computes GVT, and it executes in order

  MessagePool pool_;  // of what they have received, and of what waits in the calendar
  MessageCalendar calendar_;
  Journal journal_;
  std::vector<TimeWarpProcess> processes_;  // the own LPs
  LpHeap schedule_;                         // by floor, without those that are held
  bool is_plain_ = true;                    // all of them are: messages go to the calendar
  std::vector<std::uint32_t> held_;         // may hold (dependency waits); in any order
  std::vector<char> is_held_;               // whether an LP is among them
  std::vector<std::uint32_t> may_be_faulty_;
  LpHeap uncommitted_;  // by the earliest time that a commit has something to do for
  EventRecorder recorder_;
  WorkerClock clock_;
  WorkerEffects effects_;
  std::vector<Message> arrived_;              // to be delivered next
  std::vector<Message> delivering_;           // scratch
  std::vector<Message> held_back_;            // only if it shuffles, and not in lockstep
  std::vector<std::uint32_t> touched_;        // scratch
  std::vector<std::uint32_t> places_;         // scratch
  std::vector<std::vector<Message>> remote_;  // by receiving worker of all ranks
  std::vector<Message> received_;             // from other ranks; scratch

  GvtPart gvt_part_;
  VirtualTime gvt_ = kBeginning;
  static constexpr std::uint32_t kNobody = ~0u;
  std::uint32_t executing_ = kNobody;
  VirtualTime open_until_ = kBeginning;  // LPs may execute what is earlier
  std::optional<CommittedFault> fault_;
  std::uint32_t stopped_ = 0;
  bool finished_ = false;
  std::size_t batch_size_ = 1;
  std::chrono::steady_clock::duration batch_took_{};  // the last one
  std::chrono::steady_clock::time_point last_report_{};
  std::size_t executed_since_report_ = 0;
  std::chrono::microseconds patience_;  // how long it sleeps before it asks for a round
  std::chrono::microseconds nap_ =
      kShortestNap;  // how long it sleeps between looks at the other ranks
  std::chrono::steady_clock::time_point round_due_{};  // if nobody asks for one before
  SplitMix64 random_;
};

inline void Worker::note_lead(std::int64_t t) {
  if (t <= gvt_.t) return;
  const auto lead = static_cast<std::uint64_t>(t) - static_cast<std::uint64_t>(gvt_.t);
  effects_.counters.lead_sum += lead;
  effects_.counters.lead_max = std::max(effects_.counters.lead_max, lead);
}

// Moves the window on, if it can be told how far without a round.
inline bool Worker::reopen() {
  const VirtualTime next = earliest();
  if (!knows_gvt() || next >= end_) return false;
  gvt_ = next;
  open_until_ = end_of_window();
  return true;
}

}  // namespace soda::kernel
