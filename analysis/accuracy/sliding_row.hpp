// Boxes in a row on a level floor that slide along x and hit each other: from one event to the
// next.
#pragma once

#include <vector>

#include "analysis/accuracy/closed_forms.hpp"

namespace soda::analysis {

// One motion for each body, in their order. `half_m`: of their lengths along x. Between events each
// slides on a parabola until it stops; two that meet exchange momentum by Newton's restitution. May
// use libm: it judges states, it does not make them.
std::vector<MotionAt> sliding_row(const std::vector<StartingBody>& bodies,
                                  const std::vector<double>& half_m, double gravity_m_s2,
                                  const scenarios::SlidingRow& answer);

}  // namespace soda::analysis
