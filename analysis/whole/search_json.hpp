// Results of the searches over whole scenarios as JSON: one object, keys as in README.md, "JSON
// output".
#pragma once

#include <string>

#include "analysis/whole/continuity_command.hpp"
#include "analysis/whole/whole_command.hpp"

namespace soda::analysis {

std::string whole_json(const WholeResult& result);
std::string continuity_json(const ContinuityResult& result);

}  // namespace soda::analysis
