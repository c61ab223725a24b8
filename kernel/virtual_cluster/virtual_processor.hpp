// One processor of the virtual cluster: its LPs, what it costs to execute them, and its messages.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "kernel/api/partition.hpp"
#include "kernel/queues/lp_heap.hpp"
#include "kernel/queues/sliding_vector.hpp"
#include "kernel/time_warp/time_warp_process.hpp"
#include "kernel/virtual_cluster/processor_clock.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"

namespace soda::kernel {

class VirtualProcessor {
 public:
  VirtualProcessor(std::size_t index, const Partition& partition,
                   std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                   const VirtualOptions& options, EventRecorder& recorder);

  // A message has arrived; it is looked at by the next take_in().
  void receive(Message message) { inbox_.push_back(std::move(message)); }

  // Delivers what has arrived and settles; what that sends to own LPs, too. Everything else that
  // leaves is appended to `outgoing`.
  void take_in(std::vector<Message>& outgoing);

  // The LP to execute next, if any is within the window.
  std::optional<std::uint32_t> choose(VirtualTime gvt);

  struct Done {
    VirtualTime time;
    std::int64_t cost_ns = 0;
  };
  // Executes the own LP `own`. What it sends is kept until release().
  Done execute(std::uint32_t own, VirtualTime gvt);
  // The execution has ended: own messages can be taken in, others are appended to `outgoing`.
  void release(std::vector<Message>& outgoing);
  // Undoes what `own` has just executed at `time`, as if a straggler had come. Allowed once for
  // each time, so that there is an end to it, and not behind a GVT that is being computed.
  bool may_undo(std::uint32_t own, VirtualTime time, VirtualTime gvt) const;
  void undo(std::uint32_t own, VirtualTime time);

  // Nothing else is left to happen: what is awaited will not come.
  void stop_waiting();

  // Earliest of all floors and of all messages that are here: what GVT is the minimum of.
  VirtualTime floor() const;
  // Of lockstep, where nobody is held.
  VirtualTime lowest_floor() const { return schedule_.top_time(); }
  std::uint32_t lowest() const { return schedule_.top(); }
  VirtualTime floor_of(std::uint32_t own) const { return processes_[own].floor(); }
  std::optional<CommittedFault> first_fault() const;

  // Commits everything < limit; `gvt` as fossil horizon, unless the run is finished. Returns how
  // many executions that are.
  std::uint64_t commit(VirtualTime limit, VirtualTime gvt, bool finished);
  // Executions that are kept, of all its LPs.
  std::size_t history();
  std::size_t lps() const { return processes_.size(); }
  const Counters& counters() const { return effects_.counters; }
  // At the end of a run: what stands, what does not; `cut_ns` of its executions would have come
  // after the end.
  void add_to(TimeAccount& account, std::int64_t cut_ns) const;
  LpId id_of(std::uint32_t own) const { return LpId{first_lp_ + own}; }

  // State of the clock model; the cluster's.
  ProcessorClock clock;  // not of lockstep
  bool busy = false;
  bool wakes = false;                // a wake-up is queued already
  std::int64_t deaf_until_ns = 0;    // takes in nothing until then
  std::int64_t link_free_at_ns = 0;  // lockstep: when the last message has left

 private:
  struct Spent {
    VirtualTime time;
    ExecutionCost cost;
  };

  bool within_window(VirtualTime time, VirtualTime gvt) const;
  void refresh(std::uint32_t own);
  bool holds(std::uint32_t own);
  // An LP that a commit has to look at: others cost it nothing.
  void note_uncommitted(std::uint32_t own) {
    if (!is_uncommitted_[own]) uncommitted_.push_back(own);
    is_uncommitted_[own] = true;
  }
  // True if there is nothing left to do for it until it executes or hears something.
  bool commit_one(std::uint32_t own, VirtualTime limit, VirtualTime gvt, bool finished);
  void count_history(std::uint32_t own);
  void settle(std::uint32_t own);
  void note_revalidated(std::uint32_t own);
  void drop_undone(std::uint32_t own, std::uint64_t undone);
  void route(std::vector<Message>& outgoing);
  void tell_sent();

  const Partition& partition_;
  const std::size_t index_;
  const std::uint32_t first_lp_;
  const VirtualTime end_;
  const VirtualOptions& options_;
  MessagePool pool_;
  Journal journal_;
  std::vector<TimeWarpProcess> processes_;
  std::vector<SlidingVector<Spent>> spent_;  // of each LP, what stands and is not committed
  std::vector<std::map<VirtualTime, ExecutionCost>> undone_cost_;  // of each LP, by time
  std::vector<VirtualTime> undone_until_;                          // of each LP
  LpHeap schedule_;                         // by floor, without those that are held
  std::vector<std::uint32_t> held_;         // may hold (dependency waits); in any order
  std::vector<char> is_held_;               // whether an LP is among them
  std::vector<std::uint32_t> uncommitted_;  // what a commit has to touch; in any order
  std::vector<char> is_uncommitted_;        // whether an LP is among them
  std::vector<std::size_t> kept_;           // of each LP: executions, when it was last counted
  std::size_t history_ = 0;                 // their sum
  std::set<std::uint32_t> may_be_faulty_;   // all that are, and some that were
  WorkerEffects effects_;                   // .outgoing: of the execution that lasts
  std::size_t told_sent_ = 0;               // how many of these the observer has heard of
  std::vector<Message> inbox_;
  std::vector<Message> delivering_;
  std::vector<std::uint32_t> touched_;
  std::vector<LpId> candidates_;
  bool awaits_ = false;  // a message that has not come yet
  VirtualTime gvt_ = kBeginning;
  ExecutionCost committed_;
  std::uint64_t executions_committed_ = 0;
  std::int64_t rolled_back_ns_ = 0;
};

}  // namespace soda::kernel
