// The job that mpirun started this process for, and its end: one exit code, one message.
#pragma once

#include <memory>
#include <ostream>
#include <string>

#include "kernel/api/transport.hpp"

namespace soda::analysis {

// The other ranks; null if mpirun did not start this process: then no MPI is loaded. Throws
// UsageError if soda was built without MPI.
std::unique_ptr<kernel::Transport> join_job();

// How this process ends.
struct Ending {
  int code = 0;
  std::string message;      // for the user; complete lines, or empty
  bool of_another = false;  // another rank has failed, and has been agreed on
};

// Agrees with all ranks on the exit code, writes one rank's message to `err`, and ends the job at
// once if other ranks are left waiting in a run. `transport` may be null.
int end_job(kernel::Transport* transport, const Ending& ending, std::ostream& err);

}  // namespace soda::analysis
