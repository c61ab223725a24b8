#include "analysis/runs/warnings.hpp"

#include <ostream>

#include "scenarios/read_scenario.hpp"

namespace soda::analysis {

void refuse_warnings(const std::string& file,
                     const std::vector<scenarios::InputWarning>& warnings) {
  if (warnings.empty()) return;
  std::vector<scenarios::InputFault> faults;
  for (const scenarios::InputWarning& warning : warnings) {
    std::string found = warning.found;
    if (warning.more > 0) found += " (and " + std::to_string(warning.more) + " more)";
    faults.push_back({.line = warning.line,
                      .column = warning.column,
                      .pointer = warning.pointer,
                      .found = std::move(found),
                      .allowed = "no warning " + warning.kind + ", for --strict is given",
                      .hint = "likely: " + warning.likely});
  }
  throw scenarios::InputError(file, std::move(faults));
}

void tell_warnings(const std::vector<FileWarnings>& files, std::ostream& err) {
  for (const auto& [file, warnings] : files)
    for (const scenarios::InputWarning& warning : warnings)
      err << scenarios::warning_text(file, warning) << "\n";
}

}  // namespace soda::analysis
