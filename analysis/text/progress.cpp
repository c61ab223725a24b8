#include "analysis/text/progress.hpp"

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <iostream>
#include <memory>
#include <mutex>
#include <thread>

#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetween{200};

// Drawn by a thread of its own: a run tells of itself only when it commits.
class ProgressLine {
 public:
  explicit ProgressLine(std::int64_t steps)
      : estimate_(steps), drawer_([this](const std::stop_token& stop) { draw(stop); }) {}

  ~ProgressLine() {
    drawer_.request_stop();
    drawer_.join();
    if (drawn_) std::cerr << "\r\x1b[K" << std::flush;
  }

  void note(const models::Progress& progress) {
    const std::lock_guard lock(mutex_);
    estimate_.note(progress.committed_step, elapsed_s());
    efficiency_ = progress.efficiency;
  }

 private:
  double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  void draw(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, stop, kBetween, [&stop] { return stop.stop_requested(); })) {
      const std::string text = estimate_.text(elapsed_s()) + ", efficiency " +
                               format_number(100.0 * efficiency_, 3) + " %";
      std::cerr << "\r\x1b[K" + text << std::flush;
      drawn_ = true;
    }
  }

  const Clock::time_point start_ = Clock::now();
  std::mutex mutex_;
  std::condition_variable_any wake_;
  ProgressEstimate estimate_;
  double efficiency_ = 1.0;
  bool drawn_ = false;
  std::jthread drawer_;  // last: it uses the others
};

}  // namespace

void ProgressEstimate::note(std::int64_t committed_step, double now_s) {
  if (committed_step <= advances_.back().step) return;
  advances_.push_back({now_s, committed_step});
  while (advances_.size() > 2 && advances_[1].at_s <= now_s - kWindow_s) advances_.pop_front();
}

// From the last advance that is older than the window, if one is, so that a step which takes longer
// than it still counts; up to now, so that the rate falls while nothing comes.
double ProgressEstimate::rate(double now_s) const {
  std::size_t first = 0;
  while (first + 2 < advances_.size() && advances_[first + 1].at_s <= now_s - kWindow_s) ++first;
  const std::int64_t steps = advances_.back().step - advances_[first].step;
  const double took_s = now_s - advances_[first].at_s;
  return steps > 0 && took_s > 0.0 ? static_cast<double>(steps) / took_s : 0.0;
}

std::string ProgressEstimate::text(double now_s) const {
  const std::int64_t step = advances_.back().step;
  const double per_s = rate(now_s);
  std::string text = "step " + std::to_string(step) + " of " + std::to_string(steps_) + " after " +
                     format_number(now_s, 3) + " s";
  if (per_s <= 0.0) return text + ", time left unknown";
  return text + ", " + format_number(per_s, 3) + " steps/s, " +
         format_number(static_cast<double>(steps_ - step) / per_s, 2) + " s left";
}

std::function<void(const models::Progress&)> terminal_progress(std::int64_t steps, bool quiet) {
  if (quiet || isatty(STDERR_FILENO) == 0) return {};
  const auto line = std::make_shared<ProgressLine>(steps);
  return [line](const models::Progress& progress) { line->note(progress); };
}

}  // namespace soda::analysis
