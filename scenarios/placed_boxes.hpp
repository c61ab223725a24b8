// Where the bodies and statics of a scenario are at its start, for what looks at it as a whole.
#pragma once

#include <optional>
#include <vector>

#include "physics/shapes/compiled_shape.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {

struct PlacedBoxes {
  std::vector<physics::CompiledShape> shapes;         // of the scene; meshes are left empty
  std::vector<physics::Aabb> bodies;                  // tight, by BodyId, of absent ones too
  std::vector<std::optional<physics::Aabb>> statics;  // none of a halfspace
};

PlacedBoxes placed_boxes(const Scenario& scenario);

physics::Pose pose_of(const physics::BodyState& state);
physics::Pose pose_of(const physics::StaticBody& body);

// The box around both; the longest edge of one.
physics::Aabb joined(const physics::Aabb& a, const physics::Aabb& b);
double longest_edge_m(const physics::Aabb& box);

}  // namespace soda::scenarios
