// Shapes prepared for contact computation: planes of faces, extents, mesh adjacency. No FCL here.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "physics/math/pose.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/triangle_tree.hpp"

namespace soda::physics {

// In the order of the alternatives of Shape.
enum class ShapeKind { kSphere, kBox, kCapsule, kCylinder, kHull, kMesh, kHalfSpace, kCompound };

struct FacePlane {
  Vec3 normal = Vec3::UnitZ();  // unit, outward
  double offset_m = 0.0;        // normal . x == offset on the face
};

struct MeshTriangle {
  std::array<Vec3, 3> corners_m;
  FacePlane plane;
  std::uint32_t group = 0;  // smallest index of the coplanar, edge-connected triangles
  // Edge i runs from corner i to corner i+1. An inactive edge is shared with a triangle that is
  // coplanar or rises in front of it: nothing can touch it without touching a face.
  std::array<bool, 3> edge_active{true, true, true};
  // Of an active edge: normals of contacts on it lie between that of the face and this one, which
  // is the other triangle's, or at a rim leads away from the triangle in its plane.
  std::array<Vec3, 3> edge_limit{Vec3::UnitZ(), Vec3::UnitZ(), Vec3::UnitZ()};
  // Of those two triangles, the one of smaller index: the other leaves the edge's contacts to it.
  std::array<bool, 3> edge_own{true, true, true};
};

struct CompiledShape;
struct CompiledPart {
  std::uint32_t shape = 0;  // index into SceneDescription::shapes
  Pose pose;                // in the compound's frame
  std::shared_ptr<const CompiledShape> solid;
};

// Of a compound, what is asked of it as a whole (support, boxes, extents) is that of its convex
// hull; but its smallest width is that of its thinnest part.
struct CompiledShape {
  ShapeKind kind = ShapeKind::kSphere;
  double radius_m = 0.0;                          // sphere, capsule, cylinder
  double half_length_m = 0.0;                     // capsule, cylinder
  Vec3 half_extents_m = Vec3::Zero();             // box
  FacePlane half_space;                           // halfspace
  std::vector<Vec3> vertices_m;                   // hull
  std::vector<std::vector<std::uint32_t>> faces;  // hull
  std::vector<FacePlane> face_planes;             // hull, box, caps of a cylinder
  std::vector<MeshTriangle> triangles;            // mesh
  TriangleTree tree;                              // of these
  std::vector<CompiledPart> parts;                // compound
  double min_extent_m = 0.0;       // smallest width over all directions (halfspace, mesh: 0)
  double bounding_radius_m = 0.0;  // around the origin (halfspace: 0)
  Vec3 reach_m = Vec3::Zero();     // from the origin along its axes, to the farther side (the same)
};

// `shapes`: those that a compound's parts are of.
CompiledShape compile(const Shape& shape, std::span<const Shape> shapes = {});

// Farthest point of a solid in a direction (any length), in the shape's frame. Ties: first vertex.
Vec3 support(const CompiledShape& shape, const Vec3& direction_local);

// Smallest box around a placed solid or mesh.
Aabb tight_aabb(const CompiledShape& shape, const Pose& pose);

}  // namespace soda::physics
