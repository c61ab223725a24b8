// `soda view`: an event log as a page on which the run can be looked at.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/text/output_file.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

struct ViewRequest {
  std::string file;                   // the log
  std::string page_file;              // empty: the log's name and .html
  bool force = false;                 // replaces a page that exists
  std::optional<std::int64_t> every;  // >= 1; else what keeps the bodies of a page below 14 MB
};

// Writes the page of a log; returns what is to be said of it, with a line break.
std::string write_page(LogReader& log, const scenarios::Scenario& scenario, OutputFile& page,
                       std::optional<std::int64_t> every);

// Throws FileError if the log cannot be read or the page not be written. kExitCheckFailed if a
// block is damaged: the page then ends before it.
int view_command(const ViewRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
