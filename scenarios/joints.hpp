// From what a document says of joints to those of a scene.
#pragma once

#include <vector>

#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {

// Of a scene whose bodies are all there. Faults: ids given twice, unknown or absent bodies, a body
// with itself, axes and distances without length.
void build_joints(const std::vector<JointSpec>& joints, Scenario& scenario, FaultList& faults);

}  // namespace soda::scenarios
