// The command line of `soda`: options, help, and which command they call.
#pragma once

#include <iosfwd>

#include "kernel/api/transport.hpp"

namespace soda::analysis {

// Parses and runs one command; returns its exit code. What a command reports goes to `out`, what
// the user should know about it to `err`. Throws UsageError (with "did you mean" where a known name
// is near) and what the commands throw. `transport` leads to the other ranks of the job, if mpirun
// started one: not the root's `out` and `err` go nowhere then.
int run_command_line(int argc, const char* const* argv, kernel::Transport* transport,
                     std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
