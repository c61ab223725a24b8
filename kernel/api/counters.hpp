// What a run has done: how much of what, and which ways of the kernel it has taken.
#pragma once

#include <cstdint>
#include <span>

namespace soda::kernel {

// Work of a run. Counts of executed (LP, time) bags, not of messages, unless said otherwise.
struct Counters {
  std::uint64_t executed = 0;     // bags executed, including those rolled back later
  std::uint64_t rolled_back = 0;  // executed bags that were undone, but not put back
  std::uint64_t committed = 0;    // calls of commit: executed - rolled_back if nothing failed
  std::uint64_t rollbacks = 0;    // calls of rewind
  std::uint64_t stragglers = 0;   // messages (or anti-messages) at or before the last executed time
  std::uint64_t messages = 0;     // positive messages sent
  std::uint64_t anti_messages = 0;  // empty versions sent
  std::uint64_t withdrawn = 0;      // of these, sent at once because a rollback changes what comes
  std::uint64_t jumps = 0;          // times that undone executions were put back in force
  std::uint64_t absorbed = 0;       // changed bags that needed no rollback
  std::uint64_t adopted = 0;        // re-sends equal to what was already sent (lazy cancellation)
  std::uint64_t coasted = 0;        // bags executed again with the inputs that they had
  std::uint64_t in_order = 0;       // bags executed as they came, without a history of the LP
  std::uint64_t taken_back = 0;     // of these, moved to the LP's history before GVT passed them
  std::uint64_t alone = 0;     // bags after which their worker knew GVT by itself, without a round
  std::uint64_t batches = 0;   // looks at the inbox after more than one bag
  std::uint64_t shuffled = 0;  // LPs picked at random, by a scheduling seed
  std::uint64_t held = 0;      // dependency waits: times that an LP waited for messages it expects
  std::uint64_t failed = 0;    // executions that an exception left
  std::uint64_t to_threads = 0;    // messages put into another thread's inbox
  std::uint64_t to_ranks = 0;      // messages for other ranks
  std::uint64_t gvt_rounds = 0;    // and why they began:
  std::uint64_t full_rounds = 0;   // so many bags were executed
  std::uint64_t timed_rounds = 0;  // so much time has passed
  std::uint64_t idle_rounds = 0;   // a worker had nothing to execute
  std::uint64_t lead_sum = 0;      // sum over executed bags of t - GVT.t, for the mean lead
  std::uint64_t lead_max = 0;
  // Most that one LP held of what rollback needs: inputs, executed times and outputs. Looked at
  // when it commits, which is where it is largest. 0: no history was kept.
  std::uint64_t history_max = 0;

  // Executions that stand and that GVT has not passed, as far as GVT has been followed.
  std::uint64_t uncommitted() const { return executed - rolled_back - committed; }
};

Counters& operator+=(Counters& sum, const Counters& more);

// A way that a run can take through the kernel, and the counter that is above 0 if it did.
struct KernelPath {
  const char* name;  // as in reports: lower case, words joined by '_'
  std::uint64_t Counters::*count;
};

// All there are, in the order of reports.
std::span<const KernelPath> kernel_paths();

}  // namespace soda::kernel
