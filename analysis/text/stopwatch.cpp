#include "analysis/text/stopwatch.hpp"

#include <time.h>

namespace soda::analysis {
namespace {

double clock_s(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

double thread_cpu_s() { return clock_s(CLOCK_THREAD_CPUTIME_ID); }

Stopwatch::Stopwatch()
    : wall_start_(std::chrono::steady_clock::now()),
      cpu_start_s_(clock_s(CLOCK_PROCESS_CPUTIME_ID)) {}

Cost Stopwatch::elapsed() const {
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - wall_start_;
  return {wall.count(), clock_s(CLOCK_PROCESS_CPUTIME_ID) - cpu_start_s_};
}

}  // namespace soda::analysis
