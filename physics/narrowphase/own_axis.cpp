#include <algorithm>
#include <cmath>

#include "physics/narrowphase/contact_axis.hpp"
#include "physics/narrowphase/core_distance.hpp"

namespace soda::physics {
namespace {

// Gap side: the distance of the cores; the skins are taken off it.
struct CoreAxis {
  Axis axis;  // not found: farther apart than the range, or
  bool cores_overlap = false;
  double separation_m = 0.0;  // of the cores with their skins, where found
};

CoreAxis core_axis(const Solid& a, double skin_a, const Solid& b, double skin_b, double range) {
  constexpr double kTiny = 1e-6;  // of both widths
  const double size = a.placed.shape.min_extent_m + b.placed.shape.min_extent_m;
  const Vec3 between = b.placed.pose.position - a.placed.pose.position;
  const CoreGap gap = core_gap({a.placed, skin_a}, {b.placed, skin_b},
                               between == Vec3::Zero() ? Vec3(Vec3::UnitZ()) : between,
                               kTiny * size, range + skin_a + skin_b);
  CoreAxis out{{}, gap.overlap, gap.distance_m - skin_a - skin_b};
  if (gap.overlap || gap.far || out.separation_m > range) return out;
  out.axis.found = out.axis.nearest = gap.normal.allFinite();
  out.axis.normal = gap.normal;
  out.axis.witness = 0.5 * (gap.on_a + gap.normal * skin_a + gap.on_b - gap.normal * skin_b);
  return out;
}

// By how much the edges of a cylinder stick out of its core with its skin.
double edges_m(const Solid& solid) {
  constexpr double kOfSkin = 0.4143;  // more than the root of 2 less 1
  return solid.placed.shape.kind == ShapeKind::kCylinder ? kOfSkin * solid.geometry.core_skin_m
                                                         : 0.0;
}

// Whether the other's extreme point is over a face that a solid shows along its outward normal.
bool is_over_face(const PlacedShape& of, const PlacedShape& other, const Vec3& outward) {
  const SupportFeature face = support_feature(of, outward);
  if (!is_along(face, outward)) return false;
  const Vec3 point = support_point(other, -outward);
  for (int i = 0; i < face.count; ++i) {
    const Vec3& from = face.points[i];
    const Vec3& to = face.points[i + 1 == face.count ? 0 : i + 1];
    if (face.normal.cross(to - from).dot(point - from) < 0.0) return false;
  }
  return true;
}

// Cylinders without their edges are looked at first: what lies on a cap or a side is found so, also
// where it overlaps. Along any direction the whole solids are no farther apart. As far, or an edge
// over a face, and it is theirs; else an edge is what is nearest, and they are looked at whole.
CoreAxis nearest_axis(const Solid& a, const Solid& b, double range) {
  constexpr double kTiny = 1e-6;  // of the smaller width
  const double edges = edges_m(a) + edges_m(b);
  CoreAxis round = core_axis(a, a.geometry.core_skin_m, b, b.geometry.core_skin_m, range + edges);
  if (edges == 0.0 || !round.axis.found) return round;
  const double width = std::min(a.placed.shape.min_extent_m, b.placed.shape.min_extent_m);
  const Vec3& normal = round.axis.normal;
  const double whole = separation_along(a.placed, b.placed, normal);
  if (whole < round.separation_m - kTiny * width && !is_over_face(b.placed, a.placed, -normal) &&
      !is_over_face(a.placed, b.placed, normal))
    return core_axis(a, skin_of(a.placed.shape), b, skin_of(b.placed.shape), range);
  round.separation_m = whole;
  round.axis.found = round.separation_m <= range;
  return round;
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
  auto [axis, cores_overlap, separation_m] = nearest_axis(a, b, range_m);
  if (!cores_overlap && !axis.found) return axis;
  if (cores_overlap) {
    axis.found = axis.nearest = true;
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
