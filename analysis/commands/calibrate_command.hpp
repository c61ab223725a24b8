// `soda calibrate`: what work costs on this machine, and how well that foretells what runs take.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "kernel/api/transport.hpp"

namespace soda::analysis {

struct CalibrateRequest {
  std::vector<std::string> files;    // scenarios
  std::string library;               // a folder of them; empty: none
  std::string costs_file;            // costs that were measured before; empty: they are measured
  std::string output_file;           // where to write them; empty: nowhere
  std::vector<unsigned> threads;     // of the runs that are foretold; none: no such runs
  kernel::Transport* job = nullptr;  // over whose ranks these are; null: over threads alone
  std::optional<std::int64_t> steps;
  int repeat = 3;
  bool check = false;  // exit code 1 if a prediction is off by more than kAllowed
  bool json = false;
  bool force = false;  // an existing file is replaced
};

// Predicted over measured: from 1 - kAllowed to 1 + kAllowed.
inline constexpr double kAllowed = 0.15;

// Exit code 1 also if a run on the cluster ended with other bits than that over threads or ranks.
// Over ranks costs must have been measured before: ranks that wait would take time from them.
int calibrate_command(const CalibrateRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
