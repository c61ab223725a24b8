// `soda what-if`: a logged run once more on the virtual cluster, with one thing changed.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/runs/overrides.hpp"

namespace soda::analysis {

struct WhatIfRequest {
  std::string file;
  Overrides overrides;
  std::string deliver_in_time;  // SOURCE:NUMBER, as `soda why` names a message; empty: none
  bool json = false;
};

struct ModelledRun {
  std::int64_t makespan_ns = 0;
  std::uint64_t executed = 0, rolled_back = 0, rollbacks = 0, stragglers = 0;
  std::uint64_t digest = 0;  // of the last state
  bool awaited_was_late = false;
};

struct WhatIf {
  std::string change;  // in words
  ModelledRun before, after;
};

// Dependency waits where there were none, half the buffer, twice the buffer, territories that
// follow the load: each alone, the best first.
std::vector<WhatIf> what_would_help(LogReader& log);
std::string what_if_text(const std::vector<WhatIf>& all);

// kExitCheckFailed if the change changes the trajectory. Throws UsageError for a message that was
// not late, or a log without a virtual trace that could tell.
int what_if_command(const WhatIfRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
