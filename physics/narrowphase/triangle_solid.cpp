#include "physics/narrowphase/triangle_solid.hpp"

#include <algorithm>
#include <cmath>

namespace soda::physics {
namespace {

// Square to an edge and in the triangle's plane, away from it.
Vec3 away_from(const MeshTriangle& t, int edge) {
  return (t.corners_m[(edge + 1) % 3] - t.corners_m[edge]).cross(t.plane.normal).normalized();
}

}  // namespace

TriangleSolid::TriangleSolid() {
  geometry_.shape.kind = ShapeKind::kHull;
  geometry_.shape.vertices_m.resize(3);
  geometry_.shape.faces = {{0, 1, 2}};
  geometry_.shape.face_planes.resize(1);
}

void TriangleSolid::set(const MeshTriangle& triangle, const Pose& pose) {
  CompiledShape& shape = geometry_.shape;
  const Vec3 centre = (triangle.corners_m[0] + triangle.corners_m[1] + triangle.corners_m[2]) / 3.0;
  shape.bounding_radius_m = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    shape.vertices_m[i] = triangle.corners_m[i] - centre;
    shape.bounding_radius_m = std::max(shape.bounding_radius_m, shape.vertices_m[i].norm());
  }
  shape.face_planes[0] = {triangle.plane.normal, triangle.plane.normal.dot(shape.vertices_m[0])};
  geometry_.triangle = &triangle;
  pose_ = {pose.rotation, pose.to_world(centre)};
}

TriangleNormal allowed_normal(const MeshTriangle& triangle, const Vec3& direction) {
  constexpr double kFace = 1e-12;  // squared sine: rounding of a direction along the face's normal
  const Vec3& n = triangle.plane.normal;
  const double up = n.dot(direction);
  TriangleNormal along_face{n, -1, false};
  if (up > 0.0 && (direction - n * up).squaredNorm() <= kFace) return along_face;
  TriangleNormal best = along_face;
  double farthest = 0.0;
  for (int i = 0; i < 3; ++i) {
    if (!triangle.edge_active[i]) continue;
    const Vec3 away = away_from(triangle, i);
    const double out = away.dot(direction);
    if (!(out > farthest)) continue;
    farthest = out;
    const Vec3& limit = triangle.edge_limit[i];
    const double beyond = out * limit.dot(n) - up * limit.dot(away);
    // A corner is one of its edges: what leads along the edge is left out.
    best = beyond > 0.0 ? TriangleNormal{limit, i, true}
                        : TriangleNormal{(away * out + n * up).normalized(), i, false};
  }
  return best;
}

Separation overlap_with_triangle(const PlacedShape& a, const Solid& triangle) {
  constexpr int kHalvings = 40;
  const MeshTriangle& t = *triangle.geometry.triangle;
  const Mat3& rotation = triangle.placed.pose.rotation;
  const Vec3 face = rotation * t.plane.normal;
  Separation best{-face, separation_along(a, triangle.placed, -face)};
  for (int i = 0; i < 3; ++i) {
    if (!t.edge_active[i]) continue;
    // From the face's normal towards the limit; the way to the best one has one top.
    const Vec3 towards = rotation * t.edge_limit[i] - face;
    const auto at = [&](double share) -> Separation {
      const Vec3 normal = -(face + towards * share).normalized();
      return {normal, separation_along(a, triangle.placed, normal)};
    };
    double low = 0.0, high = 1.0;
    for (int k = 0; k < kHalvings && high - low > 1e-6; ++k) {
      const double left = low + 0.382 * (high - low), right = low + 0.618 * (high - low);
      (at(left).distance_m < at(right).distance_m ? low : high) =
          at(left).distance_m < at(right).distance_m ? left : right;
    }
    const Separation found = at(0.5 * (low + high));
    if (found.distance_m > best.distance_m) best = found;
  }
  return best;
}

}  // namespace soda::physics
