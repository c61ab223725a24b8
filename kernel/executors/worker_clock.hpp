// Where a worker thread's time goes, by the machine's clock.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace soda::kernel {

// What a worker does; it does one of them at any time.
enum class WorkerPhase : std::uint8_t {
  kWaiting,
  kMessages,   // taken in, delivered, handed over
  kUndoing,    // rollbacks, and what follows at once
  kExecuting,  // and what comes with it: choosing, collecting, sending to own LPs
  kGvt,        // reports, outcomes and commits
};
inline constexpr std::size_t kWorkerPhases = 5;

// Waits from the begin of the worker group's run on.
class WorkerClock {
 public:
  using Point = std::chrono::steady_clock::time_point;

  explicit WorkerClock(bool runs) : runs_(runs) {
    if (runs_) since_ = std::chrono::steady_clock::now();
  }

  // Returns what it did before.
  WorkerPhase enter(WorkerPhase phase) {
    const WorkerPhase before = phase_;
    if (!runs_ || phase == before) return before;
    count_until(std::chrono::steady_clock::now());
    phase_ = phase;
    return before;
  }
  // The worker group's run ends.
  void end_run(Point end) {
    if (runs_) count_until(end);
  }

  std::int64_t in(WorkerPhase phase) const { return spent_ns_[static_cast<std::size_t>(phase)]; }

 private:
  void count_until(Point now) {
    spent_ns_[static_cast<std::size_t>(phase_)] +=
        std::chrono::duration_cast<std::chrono::nanoseconds>(now - since_).count();
    since_ = now;
  }

  const bool runs_;
  WorkerPhase phase_ = WorkerPhase::kWaiting;
  Point since_{};
  std::array<std::int64_t, kWorkerPhases> spent_ns_{};
};

}  // namespace soda::kernel
