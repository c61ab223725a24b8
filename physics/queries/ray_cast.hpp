// What a ray meets first. A question about states, which changes nothing.
#pragma once

#include <optional>
#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

struct Ray {
  Vec3 from_m = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();  // unit
  double length_m = 1.0;           // >= 0, finite
};

struct RayHit {
  BodyId id{};  // of a body or a static
  double distance_m = 0.0;
  Vec3 point_m = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  // unit, outward
};

// The nearest surface that the ray enters; of equally near ones that of the lowest id. A solid in
// which it begins is not entered; a mesh is entered through the front of its triangles. `ids`
// ascending, states[i] of ids[i]. Takes time for each body, little for those that are far from it.
std::optional<RayHit> cast_ray(const SceneDescription& scene, const Geometry& geometry,
                               std::span<const BodyId> ids, std::span<const BodyState> states,
                               const Ray& ray);

}  // namespace soda::physics
