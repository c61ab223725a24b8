// The first touch of two solids in free flight.
#pragma once

#include <optional>

#include "physics/continuous/conservative_advancement.hpp"
#include "physics/continuous/time_of_impact.hpp"

namespace soda::physics {

struct Touch {
  Impact impact;
  Vec3 normal = Vec3::UnitZ();  // from a to b
};

struct TouchSearch {
  double touching_m = 0.0;  // see touching_gap_m()
  double width_m = 0.0;     // of the smaller body
  double begin_s = 0.0;     // the solids are apart until then
  double most_s = 0.0;
};

// From the centre of a to that of b.
Vec3 first_guess(const Solid& a, const Solid& b);

// Leaves the solids at that time. As time_of_impact().
std::optional<Touch> first_touch(const TouchSearch& search, FlyingSolids& solids);

}  // namespace soda::physics
