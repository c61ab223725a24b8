// A program as a user starts it, with an end to its time and memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace soda::analysis {

// The first ends what goes on and on, on a busy machine as on an idle one; the second what waits
// for something that does not come.
struct ProgramLimits {
  double cpu_s = 60.0;  // of each process
  double wall_s = 600.0;
  std::uint64_t address_bytes = 0;  // of each process; 0: no limit
};

struct ProgramOutcome {
  bool timed_out = false;  // ended by either of them
  int exit_code = -1;      // -1: ended by a signal
  int signal = 0;
  std::string out, err;
  double wall_s = 0.0;
};

// Runs argv[0], looked up in PATH, with an empty standard input, and waits until it has ended. What
// has not ended by then is ended with everything that it started, also what has process groups of
// its own, as ranks of mpirun have. From a program with one thread. Throws CheckFailed if no
// process can be made.
ProgramOutcome run_program(const std::vector<std::string>& argv, const ProgramLimits& limits);

// The path of the running program.
std::string own_program();

}  // namespace soda::analysis
