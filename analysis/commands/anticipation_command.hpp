// `soda anticipation`: what buffers buy: how long they hide an overload, or how fast runs are with
// them.
#pragma once

#include <iosfwd>
#include <string>

#include "analysis/anticipation/anticipation_run.hpp"
#include "analysis/runs/overrides.hpp"

namespace soda::analysis {

struct AnticipationRequest {
  std::string file;  // scenario; empty: idle_scene()
  Overrides overrides;
  AnticipationOptions options;
  std::string peak = "all@1";     // WORLDS@FROM[+FOR] or random:SEED
  std::string mode = "modelled";  // measured, modelled, law or all
  bool over_makespan = false;     // instead: makespan_over_buffers()
  bool paper = false;             // the paper's Figure 8
  bool json = false, csv = false;
  bool quiet = false;
  std::string report_file;  // HTML; empty: none
  std::string command;      // as typed, for the page
  bool force = false;       // replaces it if it exists
};

// "0,2@1.5+2": worlds 0 and 2, from second 1.5 on, for 2 s; "all@1": all, for ever; "random:7".
// Throws UsageError; `worlds`: how many there are.
PeakOptions peak_of(const std::string& text, std::uint32_t worlds);

// Throws UsageError for options out of range, InputError and FileError for files.
int anticipation_command(const AnticipationRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
