#include "kernel/gvt.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "kernel/invariant.hpp"

namespace soda::kernel {
namespace {

// How often a worker looks whether the others have come before it sleeps, about 20 us: falling
// asleep and being woken takes longer than many a round.
constexpr int kLooks = 500;

void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

// Keeps the first of two faults; of equals the one that is there already.
void prefer_first(const std::optional<CommittedFault>& fault,
                  std::optional<CommittedFault>& first) {
  if (!fault) return;
  if (!first || std::pair(fault->when, fault->lp) < std::pair(first->when, first->lp))
    first = fault;
}

}  // namespace

GvtRounds::GvtRounds(unsigned workers, unsigned sharing)
    : workers_(workers), spins_(sharing <= std::thread::hardware_concurrency()) {}

template <class Conclude>
void GvtRounds::meet(std::unique_lock<std::mutex>& lock, const Conclude& conclude) {
  const std::uint64_t meeting = meetings_.load(std::memory_order_relaxed);
  if (++arrived_ == workers_) {
    conclude();
    arrived_ = 0;
    meetings_.store(meeting + 1, std::memory_order_release);
    meeting_over_.notify_all();
    return;
  }
  const auto over = [&] {
    return meetings_.load(std::memory_order_acquire) != meeting || run_stopped();
  };
  if (spins_) {
    lock.unlock();
    for (int look = 0; look < kLooks && !over(); ++look) pause();
    lock.lock();
  }
  meeting_over_.wait(lock, over);
}

bool GvtRounds::stop_all() {
  std::unique_lock lock(mutex_);
  meet(lock, [&] { least_ = {}; });
  return !run_stopped();
}

GvtOutcome GvtRounds::report(const GvtReport& report) {
  std::unique_lock lock(mutex_);
  least_.floor = std::min(least_.floor, report.floor);
  prefer_first(report.fault, least_.fault);
  if (report.of_all_ranks) least_.of_all_ranks = report.of_all_ranks;
  meet(lock, [&] {
    SODA_ASSERT(least_.floor >= outcome_.gvt, "GVT went back from ", outcome_.gvt, " to ",
                least_.floor);
    outcome_.least = least_;
    outcome_.gvt = least_.of_all_ranks ? least_.of_all_ranks->gvt : least_.floor;
    if (least_.fault && least_.fault->when < outcome_.gvt) outcome_.fault = least_.fault;
    if (least_.of_all_ranks) prefer_first(least_.of_all_ranks->fault, outcome_.fault);
    ++rounds_;
    requested_.store(false, std::memory_order_release);
  });
  GvtOutcome outcome = outcome_;
  outcome.stopped = run_stopped();
  return outcome;
}

std::optional<Counters> GvtRounds::finish(const Counters& counters) {
  const std::lock_guard lock(mutex_);
  sum_ += counters;
  if (++finished_ < workers_) return std::nullopt;
  finished_ = 0;
  Counters sum = std::exchange(sum_, {});
  sum.gvt_rounds = rounds_;
  return sum;
}

void GvtRounds::stop_run() {
  const std::lock_guard lock(mutex_);
  run_stopped_.store(true, std::memory_order_release);
  meeting_over_.notify_all();
}

Counters& operator+=(Counters& sum, const Counters& more) {
  sum.executed += more.executed;
  sum.rolled_back += more.rolled_back;
  sum.committed += more.committed;
  sum.rollbacks += more.rollbacks;
  sum.stragglers += more.stragglers;
  sum.messages += more.messages;
  sum.anti_messages += more.anti_messages;
  sum.jumps += more.jumps;
  sum.absorbed += more.absorbed;
  sum.adopted += more.adopted;
  sum.gvt_rounds += more.gvt_rounds;
  sum.lead_sum += more.lead_sum;
  sum.lead_max = std::max(sum.lead_max, more.lead_max);
  sum.history_max = std::max(sum.history_max, more.history_max);
  return sum;
}

}  // namespace soda::kernel
