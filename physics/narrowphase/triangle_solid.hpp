// One triangle of a mesh as a convex solid of no thickness.
#pragma once

#include "physics/narrowphase/separation.hpp"

namespace soda::physics {

// May be set to one triangle after the other.
class TriangleSolid {
 public:
  TriangleSolid();
  // `pose` is the mesh's; the triangle has to stay where it is.
  void set(const MeshTriangle& triangle, const Pose& pose);
  Solid solid() const { return {geometry_, {geometry_.shape, pose_}}; }

 private:
  ShapeGeometry geometry_;
  Pose pose_;
};

// Where a direction from a triangle to a solid may point, so that they touch and no neighbour of
// the triangle is in between: along the face's normal, or over an active edge between the normals
// of both its faces.
struct TriangleNormal {
  Vec3 normal = Vec3::UnitZ();  // unit: the nearest direction that may be
  int edge = -1;                // over this edge; else along the face's
  bool beyond = false;          // the edge's other face is what is touched
};

// In the mesh's frame.
TriangleNormal allowed_normal(const MeshTriangle& triangle, const Vec3& direction);

// Of a solid and a triangle (as b) that it touches or cuts: along the allowed normal that separates
// most.
Separation overlap_with_triangle(const PlacedShape& a, const Solid& triangle);

}  // namespace soda::physics
