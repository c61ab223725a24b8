// The report of `soda accuracy` as one HTML file: tables and log-log diagrams, no scripts.
#pragma once

#include <string>

#include "analysis/commands/accuracy_command.hpp"

namespace soda::analysis {

// The summary first; then for each case its table, and a diagram of error against CPU time for each
// measure with a bound (one for the first, if none has). Errors of 0 are drawn at the diagram's
// lower edge. `command`: as it was typed.
std::string accuracy_html(const AccuracyReport& report, const std::string& command);

}  // namespace soda::analysis
