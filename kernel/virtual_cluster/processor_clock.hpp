// The virtual wall clock of one processor of the cluster, in nanoseconds.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace soda::kernel {

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
