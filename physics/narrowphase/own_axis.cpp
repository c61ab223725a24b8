#include <algorithm>
#include <cmath>

#include "physics/narrowphase/contact_axis.hpp"
#include "physics/narrowphase/core_distance.hpp"

namespace soda::physics {
namespace {

// Gap side: the distance of the cores; the skins are taken off it.
Axis core_axis(const Solid& a, const Solid& b, double range, bool& cores_overlap) {
  constexpr double kTiny = 1e-6;  // of both widths
  const double size = a.placed.shape.min_extent_m + b.placed.shape.min_extent_m;
  const double skin_a = a.geometry.core_skin_m, skin_b = b.geometry.core_skin_m;
  const Vec3 between = b.placed.pose.position - a.placed.pose.position;
  const CoreGap gap = core_gap({a.placed, skin_a}, {b.placed, skin_b},
                               between == Vec3::Zero() ? Vec3(Vec3::UnitZ()) : between,
                               kTiny * size, range + skin_a + skin_b);
  cores_overlap = gap.overlap;
  Axis axis;
  if (gap.overlap || gap.far || gap.distance_m - skin_a - skin_b > range) return axis;
  axis.found = axis.nearest = gap.normal.allFinite();
  axis.normal = gap.normal;
  axis.witness = 0.5 * (gap.on_a + gap.normal * skin_a + gap.on_b - gap.normal * skin_b);
  return axis;
}

}  // namespace

Vec3 first_face_normal(const PlacedShape& a, const PlacedShape& b, const Vec3& normal) {
  constexpr double kSlack = 1e-3;      // of the smaller width
  constexpr double kParallel = 0.999;  // cosine
  const Vec3 of_a = support_feature(a, normal).normal;
  if (of_a.dot(normal) < kParallel) return normal;
  const double slack = kSlack * std::min(a.shape.min_extent_m, b.shape.min_extent_m);
  return separation_along(a, b, of_a) > separation_along(a, b, normal) - slack ? of_a : normal;
}

void refine_by_faces(const Solid& a, const Solid& b, double slack_share, Axis& axis) {
  constexpr double kFacePreference = 0.05;  // of the depth
  const double slack =
      slack_share * std::min(a.placed.shape.min_extent_m, b.placed.shape.min_extent_m);
  double best = separation_along(a.placed, b.placed, axis.normal);
  best -= slack + kFacePreference * std::max(0.0, -best);
  const auto consider = [&](const PlacedShape& owner, const PlacedShape& other,
                            const FacePlane& face, double sign) {
    const Vec3 outward = owner.pose.rotation * face.normal;
    // The other's centre is one of its points: its height over the face bounds the separation.
    const double bound = outward.dot(other.pose.position - owner.pose.position) - face.offset_m;
    if (bound <= best) return;
    const Vec3 normal = sign * outward;
    const double separation = separation_along(a.placed, b.placed, normal);
    if (separation > best) best = separation, axis.normal = normal;
  };
  const auto consider_all = [&](const PlacedShape& owner, const PlacedShape& other, double sign) {
    for (const FacePlane& face : owner.shape.face_planes) consider(owner, other, face, sign);
  };
  consider_all(a.placed, b.placed, 1.0);
  consider_all(b.placed, a.placed, -1.0);
}

Axis own_axis(const Solid& a, const Solid& b, double range_m) {
  bool cores_overlap = false;
  Axis axis = core_axis(a, b, range_m, cores_overlap);
  if (!cores_overlap && !axis.found) return axis;
  if (cores_overlap) {
    axis.found = true;
    const ShrunkTouch touch = touch_of_shrunk(a.placed, b.placed, true);
    axis.normal = touch.normal;
    axis.witness = touch.on_b;
  }
  refine_by_faces(a, b, kFaceSlack, axis);
  return axis;
}

Axis own_box_axis(const Solid& a, const Solid& b, double range_m) {
  // Of two boxes that lie flat on each other an edge separates more than a face by rounding, and
  // has one point of contact where a face has four.
  constexpr double kSlack = 1.5e-3;
  const Separation best = box_separation(a.placed, b.placed);
  Axis axis;
  if (best.distance_m > range_m) return axis;
  axis.found = true;
  axis.normal = best.normal;
  axis.witness = support_point(a.placed, best.normal) + best.normal * (0.5 * best.distance_m);
  refine_by_faces(a, b, kSlack, axis);
  axis.normal = first_face_normal(a.placed, b.placed, axis.normal);
  return axis;
}

Separation overlap_between(const Solid& a, const Solid& b) {
  const Vec3 normal = own_axis(a, b, 1e300).normal;
  return {normal, separation_along(a.placed, b.placed, normal)};
}

}  // namespace soda::physics
