// `soda anticipation`: the paper's Figure 8, measured and in closed form.
#pragma once

#include <iosfwd>
#include <string>

#include "analysis/anticipation.hpp"

namespace soda::analysis {

struct AnticipationRequest {
  AnticipationOptions options;
  bool json = false;
  std::string svg_file;  // empty: no plot
  bool force = false;    // replaces it if it exists
};

// Throws UsageError for options out of range, FileError if the plot cannot be written.
int anticipation_command(const AnticipationRequest& request, std::ostream& out);

}  // namespace soda::analysis
