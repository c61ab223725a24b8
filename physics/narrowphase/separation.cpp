#include "physics/narrowphase/separation.hpp"

#include <cmath>

#include "physics/narrowphase/analytic_contacts.hpp"
#include "physics/narrowphase/core_distance.hpp"
#include "physics/narrowphase/triangle_solid.hpp"

namespace soda::physics {
namespace {

// Two boxes in the frame of a.
struct BoxPair {
  const PlacedShape &a, &b;
  const Vec3 &half_a, &half_b;
  double cosine[3][3];  // of edge i of a and edge j of b
  double between[3];    // along the edges of a
  Separation best{Vec3::UnitZ(), -1e300};

  void consider(const Vec3& axis, double along, double separation) {
    if (!(separation > best.distance_m)) return;
    best.distance_m = separation;
    best.normal = along >= 0.0 ? axis : Vec3(-axis);
  }
};

BoxPair box_pair(const PlacedShape& a, const PlacedShape& b) {
  BoxPair pair{a, b, a.shape.half_extents_m, b.shape.half_extents_m, {}, {}};
  const Vec3 between = b.pose.position - a.pose.position;
  for (int i = 0; i < 3; ++i) {
    const Vec3 edge = a.pose.rotation.col(i);
    pair.between[i] = edge.dot(between);
    for (int j = 0; j < 3; ++j) pair.cosine[i][j] = edge.dot(b.pose.rotation.col(j));
  }
  return pair;
}

void consider_faces(BoxPair& pair) {
  double reach_b[3] = {pair.half_b[0], pair.half_b[1], pair.half_b[2]};
  double along_b[3] = {0.0, 0.0, 0.0};
  for (int i = 0; i < 3; ++i) {
    double reach = pair.half_a[i];
    for (int j = 0; j < 3; ++j) {
      const double cosine = std::abs(pair.cosine[i][j]);
      reach += cosine * pair.half_b[j];
      reach_b[j] += cosine * pair.half_a[i];
      along_b[j] += pair.between[i] * pair.cosine[i][j];
    }
    pair.consider(pair.a.pose.rotation.col(i), pair.between[i], std::abs(pair.between[i]) - reach);
  }
  for (int j = 0; j < 3; ++j)
    pair.consider(pair.b.pose.rotation.col(j), along_b[j], std::abs(along_b[j]) - reach_b[j]);
}

// Edge i of a and edge j of b.
void consider_edges(int i, int j, BoxPair& pair) {
  // Nearly parallel edges: what is computed by differences is too inexact, and below the second
  // bound a face tells as much as their common normal.
  constexpr double kInexact = 1e-4, kParallel = 1e-8;
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  const double c1 = pair.cosine[i1][j], c2 = pair.cosine[i2][j];
  const double squared = c1 * c1 + c2 * c2;  // of the sine
  if (squared < kParallel * kParallel) return;
  const double along = pair.between[i2] * c1 - pair.between[i1] * c2;
  const double reach = pair.half_a[i1] * std::abs(c2) + pair.half_a[i2] * std::abs(c1) +
                       pair.half_b[j1] * std::abs(pair.cosine[i][j2]) +
                       pair.half_b[j2] * std::abs(pair.cosine[i][j1]);
  const double apart = std::abs(along) - reach;
  const bool inexact = squared < kInexact * kInexact;
  // Without the root, where the outcome is clear: positive only if better than what there is.
  const double best = pair.best.distance_m;
  if (!inexact && apart < 0.0 && (best >= 0.0 || apart * apart > best * best * squared)) return;
  if (!inexact && best > 0.0 && apart * apart < best * best * squared) return;
  Vec3 axis = pair.a.pose.rotation.col(i).cross(pair.b.pose.rotation.col(j)) / std::sqrt(squared);
  if (!inexact) {
    pair.consider(axis, along, apart / std::sqrt(squared));
    return;
  }
  axis.normalize();
  if (axis.dot(pair.b.pose.position - pair.a.pose.position) < 0.0) axis = -axis;
  pair.consider(axis, 1.0, separation_along(pair.a, pair.b, axis));
}

Separation of_half_space(const PlacedShape& a, const PlacedShape& b) {
  const Vec3 up = b.pose.rotation * b.shape.half_space.normal;
  const double height = up.dot(support_point(a, -up) - b.pose.position);
  return {-up, height - b.shape.half_space.offset_m};
}

// Either is a sphere.
Separation of_sphere(const PlacedShape& a, const PlacedShape& b) {
  const bool first = a.shape.kind == ShapeKind::kSphere;
  const PlacedShape &ball = first ? a : b, &other = first ? b : a;
  const SurfacePoint nearest = nearest_surface(other, ball.pose.position);
  return {first ? Vec3(-nearest.outward) : nearest.outward,
          nearest.distance_m - ball.shape.radius_m};
}

}  // namespace

Separation box_separation(const PlacedShape& a, const PlacedShape& b) {
  BoxPair pair = box_pair(a, b);
  consider_faces(pair);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) consider_edges(i, j, pair);
  return pair.best;
}

double gap_along(const PlacedShape& a, const PlacedShape& b, const Vec3& normal) {
  return b.shape.kind == ShapeKind::kHalfSpace ? of_half_space(a, b).distance_m
                                               : separation_along(a, b, normal);
}

Separation separation_between(const Solid& a, const Solid& b, const Vec3& guess) {
  constexpr double kTiny = 1e-10;  // of both widths: where the direction is lost in rounding
  const PlacedShape &pa = a.placed, &pb = b.placed;
  const ShapeKind ka = pa.shape.kind, kb = pb.shape.kind;
  if (kb == ShapeKind::kHalfSpace) return of_half_space(pa, pb);
  if (ka == ShapeKind::kBox && kb == ShapeKind::kBox) return box_separation(pa, pb);
  const bool sphere = ka == ShapeKind::kSphere || kb == ShapeKind::kSphere;
  if (sphere && ka != ShapeKind::kHull && kb != ShapeKind::kHull) return of_sphere(pa, pb);
  const double skin_a = skin_of(pa.shape), skin_b = skin_of(pb.shape);
  const double tiny = kTiny * (pa.shape.min_extent_m + pb.shape.min_extent_m);
  const CoreGap gap = core_gap({pa, skin_a}, {pb, skin_b}, guess, tiny);
  if (gap.overlap)
    return b.geometry.triangle ? overlap_with_triangle(pa, b) : overlap_between(a, b);
  return {gap.normal, gap.least_m - skin_a - skin_b};
}

}  // namespace soda::physics
