// Telling of what a scenario hardly means.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "scenarios/scenario.hpp"

namespace soda::analysis {

struct FileWarnings {
  std::string file;
  std::vector<scenarios::InputWarning> warnings;
};

// A line each.
void tell_warnings(const std::vector<FileWarnings>& files, std::ostream& err);

// Where there are warnings, throws InputError with each of them as a fault: --strict.
void refuse_warnings(const std::string& file, const std::vector<scenarios::InputWarning>& warnings);

}  // namespace soda::analysis
