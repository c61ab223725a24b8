// Agreement of the workers on GVT: stop-the-world rounds with two meetings.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>

#include "kernel/executor.hpp"
#include "kernel/virtual_time.hpp"

namespace soda::kernel {

// What ranks have agreed on, each by its communicating worker.
struct RankGvt {
  VirtualTime gvt = kBeginning;
  std::optional<CommittedFault> fault;  // the first before gvt, without its text
};

// What one worker knows while all have stopped.
struct GvtReport {
  VirtualTime floor = kNever;           // over its LPs and over the messages that lie in its inbox
  std::optional<CommittedFault> fault;  // the first of its LPs, at any time
  // From the communicating worker of a rank: the floors here then bound GVT, but are not GVT.
  std::optional<RankGvt> of_all_ranks;
};

// What all workers then know.
struct GvtOutcome {
  VirtualTime gvt = kBeginning;         // nothing earlier can change any more; never goes back
  std::optional<CommittedFault> fault;  // the first with a time < gvt
  bool stopped = false;                 // the run was given up; gvt means nothing
  GvtReport least;                      // of this process: the earliest floor and fault
};

// A round: stop_all() once the worker's own messages lie in the inboxes of their receivers,
// report(), commit up to the outcome, finish(). Between the meetings nobody executes or sends, so
// nothing is in flight here and the minimum of the reports is GVT itself, if there are no other
// ranks. Who waits looks for a short while and then sleeps; at once, if there are more workers than
// processors.
class GvtRounds {
 public:
  // `sharing` workers, of this process and others, run on this machine.
  GvtRounds(unsigned workers, unsigned sharing);

  // Also true when the run was given up: the round is where workers learn of it.
  bool requested() const { return requested_.load(std::memory_order_acquire) || run_stopped(); }

  // Asks all workers for a round. True for the caller that was first: it wakes those who sleep.
  bool request() { return !requested_.exchange(true, std::memory_order_acq_rel); }

  // First meeting. False if the run was given up.
  bool stop_all();

  // Second meeting.
  GvtOutcome report(const GvtReport& report);

  // Adds up the counters of all workers; the last one to finish gets the sum.
  std::optional<Counters> finish(const Counters& counters);

  // Gives up the run: everybody who waits or will wait here is let go.
  void stop_run();

  // How many rounds there were; while no worker runs.
  std::uint64_t rounds() const { return rounds_; }

  bool run_stopped() const { return run_stopped_.load(std::memory_order_acquire); }

 private:
  // All workers wait for the last, which calls `conclude` before it lets them go.
  template <class Conclude>
  void meet(std::unique_lock<std::mutex>& lock, const Conclude& conclude);

  const unsigned workers_;
  const bool spins_;  // only if each worker can have a processor
  std::atomic<bool> requested_{false};
  std::atomic<bool> run_stopped_{false};

  std::mutex mutex_;
  std::condition_variable meeting_over_;
  unsigned arrived_ = 0;
  std::atomic<std::uint64_t> meetings_{0};
  GvtReport least_;
  GvtOutcome outcome_;
  unsigned finished_ = 0;
  Counters sum_;
  std::uint64_t rounds_ = 0;
};

Counters& operator+=(Counters& sum, const Counters& more);

}  // namespace soda::kernel
