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

// The only joint of the body with this label, if it is with the world; else null.
const physics::Joint* joint_with_world(const physics::SceneDescription& scene, std::int64_t label);

}  // namespace soda::scenarios
