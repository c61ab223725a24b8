// A line of progress on a terminal.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>

#include "models/run/simulation.hpp"

namespace soda::analysis {

// What a run's progress so far says of its rest. Times in s since the begin, from any clock.
class ProgressEstimate {
 public:
  explicit ProgressEstimate(std::int64_t steps) : steps_(steps) {}

  // At `now_s`, never earlier than before.
  void note(std::int64_t committed_step, double now_s);

  // Steps a second of late: over the last kWindow_s and at least one advance, up to now. 0: no step
  // has been committed.
  double rate(double now_s) const;

  // "step 12 of 600 after 3.1 s, 4 steps/s, 147 s left"; "time left unknown" while it is.
  std::string text(double now_s) const;

  static constexpr double kWindow_s = 10.0;

 private:
  struct Advance {
    double at_s;
    std::int64_t step;
  };

  const std::int64_t steps_;
  std::deque<Advance> advances_{{0.0, 0}};  // the last one before the window, and those in it
};

// Rewrites one line of stderr five times a second, however long a step takes: committed step, time,
// rate, time left, efficiency. Empty (so that nothing is called) if `quiet` or stderr is no
// terminal. The line is erased when the last copy of the function is destroyed.
std::function<void(const models::Progress&)> terminal_progress(std::int64_t steps, bool quiet);

}  // namespace soda::analysis
