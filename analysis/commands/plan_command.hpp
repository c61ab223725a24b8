// `soda plan`: what a run of a scenario will use, and why.
#pragma once

#include <iosfwd>
#include <string>

#include "analysis/runs/overrides.hpp"

namespace soda::analysis {

struct PlanRequest {
  std::string file;
  Overrides overrides;
  bool json = false;
};

int plan_command(const PlanRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
