// Where the time of the virtual cluster's processors goes. Nanoseconds of the virtual wall clock.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

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
// is counted where it is spent. So sum_ns() is processors times makespan.
struct VirtualAccount {
  ExecutionCost standing;           // of executions that stand
  std::int64_t gvt_ns = 0;          // taking part in GVT, and committing
  std::int64_t rolled_back_ns = 0;  // executions that do not stand
  std::int64_t waiting_ns = 0;

  std::int64_t busy_ns() const { return standing.sum_ns() + gvt_ns + rolled_back_ns; }
  std::int64_t sum_ns() const { return busy_ns() + waiting_ns; }
};

// A processor's own clock: what it waits, and what GVT takes of it.
class ProcessorClock {
 public:
  std::int64_t now_ns() const { return now_ns_; }
  std::int64_t waiting_ns() const { return waiting_ns_; }
  std::int64_t gvt_ns() const { return gvt_ns_; }

  void wait_until(std::int64_t time_ns) { go(Piece::kWaiting, time_ns - now_ns_); }

  // At `time_ns`; who executes something does it after that.
  void take_part_in_gvt(std::int64_t time_ns, std::int64_t cost_ns, bool executes) {
    owes_ns_ += cost_ns;
    if (!executes) pay(time_ns);
  }

  // Begins at `time_ns` at the earliest; now_ns() is when it ends.
  void execute(std::int64_t time_ns, std::int64_t cost_ns, std::int64_t stall_ns) {
    pay(time_ns);
    go(Piece::kExecution, cost_ns);
    go(Piece::kWaiting, stall_ns);
  }

  // What it was until now has been before the end of the run.
  void complete() { count_until(now_ns_); }

  // The run ends, no earlier than the last complete(). Returns what of an execution that has begun
  // would come later.
  std::int64_t end_run(std::int64_t time_ns) {
    wait_until(time_ns);
    return count_until(time_ns);
  }

 private:
  struct Piece {
    enum Kind { kWaiting, kGvt, kExecution } kind{};
    std::int64_t ns = 0;
  };

  void pay(std::int64_t time_ns) {
    wait_until(time_ns);
    go(Piece::kGvt, owes_ns_);
    owes_ns_ = 0;
  }

  void go(Piece::Kind kind, std::int64_t ns) {
    if (ns <= 0) return;
    pieces_.push_back({kind, ns});
    now_ns_ += ns;
  }

  std::int64_t count_until(std::int64_t end_ns) {
    std::int64_t from_ns = counted_ns_, cut_ns = 0;
    for (const auto& [kind, ns] : pieces_) {
      const std::int64_t counts_ns = std::clamp<std::int64_t>(end_ns - from_ns, 0, ns);
      from_ns += ns;
      if (kind == Piece::kWaiting) waiting_ns_ += counts_ns;
      if (kind == Piece::kGvt) gvt_ns_ += counts_ns;
      if (kind == Piece::kExecution) cut_ns += ns - counts_ns;
    }
    counted_ns_ = from_ns;
    pieces_.clear();
    return cut_ns;
  }

  std::int64_t now_ns_ = 0, counted_ns_ = 0, owes_ns_ = 0;
  std::int64_t waiting_ns_ = 0, gvt_ns_ = 0;
  std::vector<Piece> pieces_;  // since counted_ns_
};

}  // namespace soda::kernel
