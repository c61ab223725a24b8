// `soda replay --interactive`: walking through what a log tells, forwards and backwards.
#pragma once

#include <iosfwd>

#include "analysis/commands/replay_command.hpp"
#include "analysis/event_log/log_reader.hpp"

namespace soda::analysis {

// Commands come from standard input, a line each, until `quit` or its end; `help` lists them. What
// is none is told on `err`, and the session goes on. Of a log without trace, steps and states can
// be walked through. kExitInput if standard input is no terminal and had a line that is no command.
int replay_session(const ReplayRequest& request, LogReader& log, std::ostream& out,
                   std::ostream& err);

}  // namespace soda::analysis
