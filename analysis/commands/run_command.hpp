// `soda run`: one run of a scenario, reported.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>

#include "analysis/event_log/log_format.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/runs/realtime.hpp"

namespace soda::analysis {

struct RunRequest {
  std::string file;    // the scenario; empty if the run goes on from `resume`
  std::string resume;  // a checkpoint or an event log
  Overrides overrides;
  std::string log_file;                          // empty: no log
  std::optional<LogLevel> log_level;             // without: kCommits
  std::optional<std::int64_t> log_every;         // states of the steps that it divides; without: 1
  std::string view_file;                         // empty: no page
  std::string checkpoint_file;                   // empty: none
  std::optional<std::int64_t> checkpoint_every;  // without: 1000
  bool force = false;                            // replaces what is written and exists
  std::string inputs;                            // empty: none; a file, or "-" for standard input
  bool json = false;
  bool step_digests = false;
  bool quiet = false;  // no progress line
  std::optional<RealTimeRequest> real_time;
};

// Returns an exit code. Errors as exceptions; nothing has been written to `out` then. A signal, or
// a log that cannot be written any more, ends the run at the next commit: what is known is
// reported, and the exit code is kExitSignal + its number, or kExitFile.
int run_command(const RunRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
