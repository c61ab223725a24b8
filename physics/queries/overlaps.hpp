// What is near a solid that is put somewhere. A question about states, which changes nothing.
#pragma once

#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// A solid that is in no scene: no mesh, halfspace or compound.
struct Probe {
  Shape shape;
  Vec3 position_m = Vec3::Zero();
  Quat orientation = Quat::Identity();
  double within_m = 0.0;  // how far what is near may be, >= 0
};

struct Neighbour {
  BodyId id{};                  // of a body or a static
  double distance_m = 0.0;      // < 0: they overlap by that
  Vec3 normal = Vec3::UnitZ();  // unit, from the probe to the neighbour
};

// Bodies, then statics, that are near, ascending by id. The distance of two boxes is that along the
// axis which separates them most, else the distance itself; where they overlap, it is what contacts
// make of it (separation.hpp). Of a compound its nearest part counts, of a mesh its nearest
// triangle. `ids` ascending, states[i] of ids[i].
std::vector<Neighbour> find_neighbours(const SceneDescription& scene, const Geometry& geometry,
                                       std::span<const BodyId> ids,
                                       std::span<const BodyState> states, const Probe& probe);

}  // namespace soda::physics
