// From what a file says is known of its run to what analysis judges by.
#pragma once

#include <vector>

#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/known_answer.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {

// `scenario` has its bodies. A body that it has not, or of a shape that the closed form is not
// about, is a fault.
std::vector<Reference> build_references(const std::vector<ReferenceSpec>& specs,
                                        const Scenario& scenario, FaultList& faults);

}  // namespace soda::scenarios
