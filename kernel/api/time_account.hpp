// Where the time of a run's processors has gone, in nanoseconds.
#pragma once

#include <cstdint>

namespace soda::kernel {

// What an execution costs, by what for. What a model does not tell apart is useful.
struct ExecutionCost {
  std::int64_t useful_ns = 0;       // one processor that has the whole model does it, too
  std::int64_t replicated_ns = 0;   // so does another processor
  std::int64_t division_ns = 0;     // only because the model is divided
  std::int64_t checkpoints_ns = 0;  // so that the execution can be undone
  std::int64_t sending_ns = 0;

  std::int64_t sum_ns() const {
    return useful_ns + replicated_ns + division_ns + checkpoints_ns + sending_ns;
  }
};

inline ExecutionCost& operator+=(ExecutionCost& sum, const ExecutionCost& more) {
  sum.useful_ns += more.useful_ns;
  sum.replicated_ns += more.replicated_ns;
  sum.division_ns += more.division_ns;
  sum.checkpoints_ns += more.checkpoints_ns;
  sum.sending_ns += more.sending_ns;
  return sum;
}

// Of all processors until the makespan: each nanosecond belongs to one of these, and each of these
// is counted where it is spent. So sum_ns() is processors times makespan. On the virtual cluster by
// its clock, where bookkeeping costs nothing; of worker threads by the machine's.
struct TimeAccount {
  ExecutionCost standing;           // of executions that stand
  std::int64_t gvt_ns = 0;          // taking part in GVT, and committing
  std::int64_t rolled_back_ns = 0;  // executions that do not stand, and undoing them
  std::int64_t bookkeeping_ns = 0;  // queues and schedules of Time Warp, beside executions
  std::int64_t waiting_ns = 0;

  std::int64_t busy_ns() const {
    return standing.sum_ns() + gvt_ns + rolled_back_ns + bookkeeping_ns;
  }
  std::int64_t sum_ns() const { return busy_ns() + waiting_ns; }
};

inline TimeAccount& operator+=(TimeAccount& sum, const TimeAccount& more) {
  sum.standing += more.standing;
  sum.gvt_ns += more.gvt_ns;
  sum.rolled_back_ns += more.rolled_back_ns;
  sum.bookkeeping_ns += more.bookkeeping_ns;
  sum.waiting_ns += more.waiting_ns;
  return sum;
}

}  // namespace soda::kernel
