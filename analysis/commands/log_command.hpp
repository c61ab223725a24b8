// `soda log`: what an event log holds, as a summary or as tables for other programs.
#pragma once

#include <iosfwd>
#include <string>

namespace soda::analysis {

struct LogRequest {
  std::string file;
  // Which lines: "steps", "states", "inputs" or "events"; of JSON and CSV only.
  std::string lines = "steps";
  bool json = false, csv = false;
};

// With --json an array of objects, a line for each; with --csv a table with a line of names. Throws
// UsageError for states or events of a log that has none.
int log_command(const LogRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
