#include "physics/continuous/face_passed.hpp"

#include <algorithm>

#include "physics/continuous/mesh_impact.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

double height(const FacePlane& plane, const Vec3& point) {
  return plane.normal.dot(point) - plane.offset_m;
}

// Through which a path enters a convex solid.
const FacePlane* entered(const std::vector<FacePlane>& faces, const Vec3& from, const Vec3& to) {
  double begin = 0.0, end = 1.0;
  const FacePlane* face = nullptr;
  for (const FacePlane& plane : faces) {
    const double before = height(plane, from), after = height(plane, to);
    if (before >= 0.0 && after >= 0.0) return nullptr;
    if (before < 0.0 && after < 0.0) continue;
    const double crossing = before / (before - after);
    if (before < 0.0)
      end = std::min(end, crossing);
    else if (face == nullptr || crossing > begin)
      begin = crossing, face = &plane;
  }
  return begin <= end ? face : nullptr;
}

// That a point is over, and over no other.
const FacePlane* face_below(const std::vector<FacePlane>& faces, const Vec3& point) {
  const FacePlane* face = nullptr;
  for (const FacePlane& plane : faces) {
    if (height(plane, point) < 0.0) continue;
    if (face != nullptr) return nullptr;
    face = &plane;
  }
  return face;
}

std::optional<FacePlane> solid_face_passed(const CompiledShape& shape, const Pose& pose,
                                           const Vec3& from_m, const Vec3& to_m,
                                           double clearance_m) {
  if (shape.kind != ShapeKind::kBox && shape.kind != ShapeKind::kHull) return std::nullopt;
  const Vec3 from = pose.to_local(from_m), to = pose.to_local(to_m);
  const FacePlane* face = entered(shape.face_planes, from, to);
  if (face == nullptr) {
    face = face_below(shape.face_planes, to);
    if (face == nullptr || !(height(*face, to) < clearance_m)) return std::nullopt;
  }
  const Vec3 normal = pose.rotation * face->normal;
  return FacePlane{normal, face->offset_m + normal.dot(pose.position)};
}

}  // namespace

std::optional<FacePlane> face_passed(const Geometry& geometry, BodyId fixed, const Vec3& from_m,
                                     const Vec3& to_m, double clearance_m) {
  const StaticGeometry& placed = geometry.impl().statics[static_index_of(fixed)];
  const CompiledShape& shape = geometry.impl().shapes[placed.shape].shape;
  if (shape.kind == ShapeKind::kMesh)
    return mesh_face_passed(geometry, fixed, from_m, to_m, clearance_m);
  for (const CompiledPart& part : shape.parts) {
    const Pose pose{placed.pose.rotation * part.pose.rotation,
                    placed.pose.to_world(part.pose.position)};
    auto face = solid_face_passed(*part.solid, pose, from_m, to_m, clearance_m);
    if (face) return face;
  }
  return solid_face_passed(shape, placed.pose, from_m, to_m, clearance_m);
}

}  // namespace soda::physics
