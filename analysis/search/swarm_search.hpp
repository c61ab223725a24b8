// Making a failing trial as small as it goes.
#pragma once

#include <string>

#include "analysis/search/shrink_limits.hpp"
#include "analysis/search/swarm_process.hpp"

namespace soda::analysis {

struct ShrunkTrial {
  Trial trial;       // fails
  std::string what;  // how
  unsigned tried = 0;
};

// Fewer LPs, less time, a smaller window, fewer processors, then fewer decisions of the adversary,
// as long as it still fails in some way. Ends at the limits.
ShrunkTrial shrink(const SwarmSubject& subject, const Trial& failing, std::string what,
                   const ShrinkLimits& limits);

// The command that runs this trial alone.
std::string reproducing_command(const SwarmSubject& subject, const Trial& trial);

// "12:3,40:1" or "none". parse throws UsageError.
std::string format_decisions(const std::vector<kernel::Decision>& decisions);
std::vector<kernel::Decision> parse_decisions(const std::string& text);

}  // namespace soda::analysis
