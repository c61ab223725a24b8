// `soda log`: what an event log holds, as a summary, or as tables and files for other programs.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace soda::analysis {

struct LogRequest {
  std::string file;
  // Which lines: "steps", "states", "worlds", "inputs" or "events"; of JSON and CSV only.
  std::string lines = "steps";
  std::vector<std::uint32_t> bodies = {};  // of states: only these, by label; none: all
  bool json = false, csv = false;
  std::string vtk_folder = {};  // instead: files for ParaView
  bool surfaces = false;        // with them
  std::optional<std::int64_t> every =
      {};              // of states and of these files: steps from one to the next
  bool force = false;  // replaces the folder if it exists
};

// With --json an array of objects, a line for each; with --csv a table with a line of names. Throws
// UsageError for states or events of a log that has none, and for options that do not go together.
int log_command(const LogRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
