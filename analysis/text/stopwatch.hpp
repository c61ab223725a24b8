// What a computation cost: wall-clock and CPU time.
#pragma once

#include <chrono>

namespace soda::analysis {

struct Cost {
  double wall_s = 0.0;
  double cpu_s = 0.0;  // of the whole process, all threads
};

// CPU time of the calling thread so far: unlike wall time, it does not count what other processes
// of a busy machine take.
double thread_cpu_s();

class Stopwatch {
 public:
  Stopwatch();  // starts
  Cost elapsed() const;

 private:
  std::chrono::steady_clock::time_point wall_start_;
  double cpu_start_s_;
};

}  // namespace soda::analysis
