#include "kernel/gvt/gvt.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {

GvtRounds::GvtRounds(unsigned workers, unsigned sharing)
    : workers_(workers), spins_(sharing <= std::thread::hardware_concurrency()) {}

void GvtRounds::pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

bool GvtRounds::request() {
  if (steps() % 2 == 1) return false;
  const std::lock_guard lock(mutex_);
  if (steps() % 2 == 1) return false;
  is_wanted_ = !is_over_;
  if (is_over_) begin();
  return !is_wanted_;
}

void GvtRounds::begin() {
  is_over_ = false;
  steps_.fetch_add(1, std::memory_order_release);
}

bool GvtRounds::report(const GvtReport& report) {
  const std::lock_guard lock(mutex_);
  least_.floor = std::min(least_.floor, report.floor);
  keep_first(report.fault, least_.fault);
  least_.stop = std::max(least_.stop, report.stop);
  if (report.of_all_ranks) least_.of_all_ranks = report.of_all_ranks;
  if (++reported_ < workers_) return false;
  outcome_.stop = least_.of_all_ranks ? least_.of_all_ranks->stop : least_.stop;
  SODA_ASSERT(least_.floor >= outcome_.gvt, "GVT went back from ", outcome_.gvt, " to ",
              least_.floor);
  outcome_.least = least_;
  outcome_.gvt = least_.of_all_ranks ? least_.of_all_ranks->gvt : least_.floor;
  if (least_.fault && least_.fault->when < outcome_.gvt) outcome_.fault = least_.fault;
  if (least_.of_all_ranks) keep_first(least_.of_all_ranks->fault, outcome_.fault);
  least_ = {};
  reported_ = 0;
  ++rounds_;
  steps_.fetch_add(1, std::memory_order_release);
  return true;
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

bool GvtRounds::end_round() {
  const std::lock_guard lock(mutex_);
  is_over_ = true;
  if (!std::exchange(is_wanted_, false)) return false;
  begin();
  return true;
}

bool GvtPart::report(GvtReport report) {
  report.floor = std::min(report.floor, std::exchange(earliest_sent_, kNever));
  ++steps_done_;
  return rounds_.report(report);
}

std::optional<Counters> GvtPart::finish(const Counters& counters) {
  ++steps_done_;
  return rounds_.finish(counters);
}

}  // namespace soda::kernel
