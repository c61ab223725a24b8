// What each contact point bears, read off the states at the end of a step.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// World frame. The load is what the solver stored for the next step: of contacts that last, the
// mean force over the step; after an impact, what they bore before it.
struct ContactLoad {
  BodyId a{}, b{};  // the lower id, always dynamic, and the higher
  // Where the contact is by now; nothing where the bodies have come apart.
  std::optional<ContactPoint> point;
  Vec3 normal = Vec3::Zero();           // unit, from a to b; 0 without a point
  double normal_newton = 0.0;           // a presses b by this, along the normal
  Vec3 friction_newton = Vec3::Zero();  // on b
};

// Of all contacts that bear anything, by (a, b) and point. `ids` ascending, `states[i]` of ids[i];
// what joints bear is left out.
std::vector<ContactLoad> contact_loads(const SceneDescription& scene, const Geometry& geometry,
                                       std::span<const BodyId> ids,
                                       std::span<const BodyState> states);

}  // namespace soda::physics
