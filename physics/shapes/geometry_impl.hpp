// Behind Geometry. FCL objects are for shape_geometry.cpp and fcl_axis.cpp: the only files that see
// FCL.
#pragma once

#include <memory>
#include <vector>

#include "physics/shapes/compiled_shape.hpp"
#include "physics/shapes/geometry.hpp"

namespace fcl {
template <typename S>
class CollisionGeometry;
}  // namespace fcl

namespace soda::physics {

struct ShapeGeometry {
  CompiledShape shape;
  // Null for meshes, halfspaces and compounds, and for all unless the scene's narrowphase is kFcl.
  std::shared_ptr<fcl::CollisionGeometry<double>> whole;
  // What contacts take off for their core_gap(): see Core.
  double core_skin_m = 0.0;
  // Of a triangle of a mesh that is looked at as a hull: which. Else null.
  const MeshTriangle* triangle = nullptr;
};

struct StaticGeometry {
  std::uint32_t shape = 0;
  Pose pose;
  Aabb box;         // of everything but halfspaces
  FacePlane plane;  // of halfspaces, in the world frame
  bool is_half_space = false;
};

// A body's end of a joint.
struct JointEnd {
  BodyId body{};
  Vec3 anchor_local_m = Vec3::Zero();
  double reach_m = 0.0;
  std::uint32_t joint = 0;  // its label
};

struct GeometryImpl {
  std::vector<ShapeGeometry> shapes;
  std::vector<StaticGeometry> statics;
  std::vector<std::uint32_t> floors;  // those that are halfspaces
  std::vector<JointEnd> joint_ends;   // of joints between bodies; ascending by body
  // By body: what a step asks of each, next to each other.
  std::vector<std::uint32_t> body_shapes;
  std::vector<bool> flies_simply;  // in flight: at a constant angular velocity, under gravity alone
  // By body: the lowest of those that joints which cannot break connect it with, itself if with
  // none but the world; kNone: it has no joint. Empty if there are no joints.
  std::vector<std::uint32_t> articulations;
};

// swept_aabb() but for what joints reach.
Aabb swept_solid(const SceneDescription& scene, const Geometry& geometry, BodyId id,
                 const BodyState& state);

// Of a body or a static.
inline const CompiledShape& shape_of(const SceneDescription& scene, const Geometry& geometry,
                                     BodyId id) {
  const std::uint32_t shape = is_static(id) ? geometry.impl().statics[static_index_of(id)].shape
                                            : scene.bodies[index_of(id)].shape;
  return geometry.impl().shapes[shape].shape;
}

// Of the smaller of the two.
inline double width_of(const SceneDescription& scene, const Geometry& geometry, BodyId a,
                       BodyId b) {
  const double width = shape_of(scene, geometry, a).min_extent_m;
  return is_static(b) ? width : std::min(width, shape_of(scene, geometry, b).min_extent_m);
}

inline const CompiledShape& shape_of_a(const PairStep& pair) {
  return shape_of(pair.scene, pair.geometry, pair.a);
}
inline const CompiledShape& shape_of_b(const PairStep& pair) {
  return shape_of(pair.scene, pair.geometry, pair.b);
}

// Contacts are kept from this part of the smaller dynamic body's smallest width on.
inline constexpr double kContactMargin = 0.01;

}  // namespace soda::physics
