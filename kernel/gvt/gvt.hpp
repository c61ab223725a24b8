// Agreement of the workers on GVT: rounds in which nobody waits for anybody.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>

#include "kernel/api/executor.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// What ranks have agreed on, each by its communicating worker.
struct RankGvt {
  VirtualTime gvt = kBeginning;
  std::optional<CommittedFault> fault;  // the first before gvt, without its text
  std::uint32_t stop = 0;               // a request that all know of
};

// What one worker knows when a round asks it.
struct GvtReport {
  VirtualTime floor = kNever;           // over its LPs and over the messages that lie in its inbox
  std::optional<CommittedFault> fault;  // the first of its LPs, at any time
  // From the communicating worker of a rank: the floors here then bound GVT, but are not GVT.
  std::optional<RankGvt> of_all_ranks;
  std::uint32_t stop = 0;  // a request to end the run early
};

// What all workers then know.
struct GvtOutcome {
  VirtualTime gvt = kBeginning;         // nothing earlier can change any more; never goes back
  std::optional<CommittedFault> fault;  // the first with a time < gvt
  std::uint32_t stop = 0;               // if not 0, the run ends at gvt
  GvtReport least;                      // of this process: the earliest floor and fault, any stop
};

// A round has two steps: all workers are asked for a report, and then to take the outcome; each
// does so when it comes by. It goes on executing and sending between the two. The next round begins
// when all have taken the outcome. After R. M. Fujimoto and M. Hybinette, "Computing global virtual
// time in shared-memory multiprocessors", ACM TOMACS 7 (4), 1997; there a flag and a count of who
// has reported stand where here the number of steps stands.
class GvtRounds {
 public:
  // `sharing` workers, of this process and others, run on this machine.
  GvtRounds(unsigned workers, unsigned sharing);

  // Begins a round, now or when the one before is taken by all. True if it has begun by this call:
  // the caller wakes those who sleep.
  bool request();

  // How many steps were asked for so far: odd while reports are wanted. The first is, from the
  // beginning.
  std::uint64_t steps() const { return steps_.load(std::memory_order_acquire); }

  // True for the last of a round: the outcome is known, and the caller wakes those who sleep.
  bool report(const GvtReport& report);

  // While steps() is even, by who has not finished yet.
  const GvtOutcome& outcome() const { return outcome_; }

  // The outcome is taken. Adds up the counters of all workers; the last one to finish gets the sum,
  // and ends the round when it has told of it.
  std::optional<Counters> finish(const Counters& counters);

  // True if the next round has begun by it: the caller wakes those who sleep.
  bool end_round();

  // Gives up the run: workers learn of it as they learn of a step.
  void stop_run() { run_stopped_.store(true, std::memory_order_release); }
  bool run_stopped() const { return run_stopped_.load(std::memory_order_acquire); }

  // Looks for a short while whether `over` holds, before somebody sleeps; not at all if there are
  // more workers than processors.
  template <class Over>
  void spin_until(const Over& over) const {
    for (int looks = 0; spins_ && looks < kLooks && !over(); ++looks) pause();
  }

  // How many rounds there were; while no worker runs.
  std::uint64_t rounds() const { return rounds_; }

 private:
  // About 20 us: falling asleep and being woken takes longer than many a round.
  static constexpr int kLooks = 500;
  static void pause();

  void begin();

  const unsigned workers_;
  const bool spins_;  // only if each worker can have a processor
  std::atomic<std::uint64_t> steps_{1};
  std::atomic<bool> run_stopped_{false};

  std::mutex mutex_;
  unsigned reported_ = 0;
  unsigned finished_ = 0;
  bool is_over_ = false;    // the newest round
  bool is_wanted_ = false;  // the next, although it is not
  GvtReport least_;
  GvtOutcome outcome_;
  Counters sum_;
  std::uint64_t rounds_ = 0;
};

// One worker's part. What it puts into the inbox of another lies there, or counts as sent here: it
// notes it, and then looks whether a report is asked for. If not, all that it has put lies in the
// inboxes when the others report, for they take what is there after they were asked. If so, the
// earliest time of what it has put since it looked last is part of its report. What it puts after
// its report is as late as that, or as a message that is part of somebody's report.
class GvtPart {
 public:
  explicit GvtPart(GvtRounds& rounds) : rounds_(rounds) {}

  // It was put into an inbox: by now.
  void note_sent(VirtualTime time) { earliest_sent_ = std::min(earliest_sent_, time); }

  // Whether a report is wanted, or an outcome to be taken, or the run was given up.
  bool is_asked() const { return rounds_.steps() != steps_done_ || rounds_.run_stopped(); }

  // To be called when all that was sent is put and noted.
  bool look() {
    if (is_asked()) return true;
    earliest_sent_ = kNever;
    return false;
  }

  // It has reported and the outcome is not known yet, or not taken.
  bool awaits_outcome() const { return steps_done_ % 2 == 1; }

  // `report` was made after look(); true as GvtRounds::report.
  bool report(GvtReport report);

  // When asked, it has reported, and the run was not given up. Good until finish().
  const GvtOutcome& outcome() const { return rounds_.outcome(); }
  std::optional<Counters> finish(const Counters& counters);

 private:
  GvtRounds& rounds_;
  std::uint64_t steps_done_ = 0;
  VirtualTime earliest_sent_ = kNever;  // since it looked and was not asked
};

}  // namespace soda::kernel
