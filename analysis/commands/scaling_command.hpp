// `soda scaling`: what division gains on the virtual cluster, and where processors' time goes.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "analysis/scaling/scaling_run.hpp"

namespace soda::analysis {

struct ScalingRequest {
  std::vector<std::string> files;  // scenarios
  std::string library;             // a folder of them; empty: none
  ScalingSetting setting;
  std::string network = "ten-gbe";
  std::string worlds;   // "1,10,100"; empty: chosen by scene
  std::string against;  // names of rivals with commas; empty: none
  std::string page;     // an HTML file with tables and pictures; empty: none
  std::string command;  // as typed, for the page
  bool json = false, csv = false;
  bool force = false;  // an existing page is replaced
};

// Prints a table for each scene. Exit code 1 if a run ended with other bits than the undivided one.
int scaling_command(const ScalingRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
