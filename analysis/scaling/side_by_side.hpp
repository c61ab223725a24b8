// A scene that grows with the number of worlds: copies of a scenario side by side.
#pragma once

#include <cstdint>
#include <string>

#include "scenarios/scenario.hpp"

namespace soda::analysis {

// Why `scenario` cannot stand beside itself; empty if it can. It cannot with user input, which
// names single bodies, nor with halfspaces that leave no direction free.
std::string why_single(const scenarios::Scenario& scenario);

// `copies` >= 1 of a scenario that is not single, along the first free axis, each as wide as the
// grid: bodies, joints, drives and statics with them; a halfspace, which is everywhere, once. The
// grid grows with them, and each copy is one world.
scenarios::Scenario side_by_side(const scenarios::Scenario& scenario, std::uint32_t copies);

}  // namespace soda::analysis
