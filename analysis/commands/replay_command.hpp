// `soda replay`: re-run an event log and compare every step, or show a state that it holds.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>

#include "analysis/runs/overrides.hpp"

namespace soda::analysis {

struct ReplayRequest {
  std::string file;
  Overrides overrides;                // over the options of the logged run
  std::optional<std::int64_t> step;   // show this step instead of re-running
  std::optional<std::uint32_t> body;  // only this body, by label
  bool as_executed = false;           // in the order of the log's trace
  std::string until, break_before;    // stop after, or before, an event (trace/event_pattern.hpp)
  bool interactive = false;           // commands of standard input (trace/replay_session.hpp)
  bool json = false;                  // what `soda run --json` says, of the run again
  bool quiet = false;
};

// kExitCheckFailed if a step diverges (the first one is told, and the run ends there), a virtual
// cluster executed otherwise with the same options, or a block is damaged; a log that is merely cut
// off is read up to its last whole block and said to be cut off.
// kExitInput after commands of a script that were none.
// Throws UsageError if it is to be had again as it was executed and cannot be (recorded_order.hpp).
int replay_command(const ReplayRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
