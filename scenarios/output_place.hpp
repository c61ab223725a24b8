// Where a scenario may have a run write.
#pragma once

#include <string>

#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"

namespace soda::scenarios {

// The file that `output.log` names, for a scenario file in `folder` (empty: the working folder);
// empty if it names none. A fault unless it lies below that folder: a scenario comes from anywhere,
// and must not choose which files of its user are written.
std::string log_place(const OutputSpec& output, const std::string& folder, FaultList& faults);

}  // namespace soda::scenarios
