#include <fcl/geometry/collision_geometry.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/box_box.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include "physics/model/stage_counters.hpp"
#include "physics/narrowphase/contact_axis.hpp"
#include "physics/narrowphase/separating_faces.hpp"

namespace soda::physics {
namespace {

fcl::Transform3d to_fcl(const Pose& pose) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = pose.rotation;
  transform.translation() = pose.position;
  return transform;
}

bool is_unit(const Vec3& v) { return std::abs(v.squaredNorm() - 1.0) < 1e-6; }

// The edges of two boxes that are extreme along the normal, and the middle of their nearest points.
Vec3 between_edges(const PlacedShape& a, int edge_a, const PlacedShape& b, int edge_b,
                   const Vec3& normal) {
  const auto middle_of_edge = [](const PlacedShape& s, int axis, const Vec3& direction) {
    Vec3 local = support(s.shape, s.pose.direction_to_local(direction));
    local[axis] = 0.0;
    return s.pose.to_world(local);
  };
  const Vec3 pa = middle_of_edge(a, edge_a, normal), pb = middle_of_edge(b, edge_b, -normal);
  const Vec3 ua = a.pose.rotation.col(edge_a), ub = b.pose.rotation.col(edge_b);
  const Vec3 between = pb - pa;
  const double cosine = ua.dot(ub), sine_squared = 1.0 - cosine * cosine;
  if (!(sine_squared > 1e-12)) return 0.5 * (pa + pb);
  const double s = (between.dot(ua) - between.dot(ub) * cosine) / sine_squared;
  const double t = s * cosine - between.dot(ub);
  return 0.5 * (pa + ua * s + pb + ub * t);
}

// The exact column that FCL names, with FCL's sign.
Vec3 face_normal(const PlacedShape& a, const PlacedShape& b, int code, const Vec3& fcl_normal) {
  const Pose& pose = code <= 3 ? a.pose : b.pose;
  const Vec3 column = pose.rotation.col((code - 1) % 3);
  const Vec3 normal = column.dot(fcl_normal) >= 0.0 ? column : Vec3(-column);
  return code <= 3 ? normal : first_face_normal(a, b, normal);
}

// Where FCL finds a contact. MPR's normal is a seed only: see refine_by_faces().
Axis overlap_axis(const Solid& a, const Solid& b) {
  fcl::CollisionRequestd request(1, true);
  fcl::CollisionResultd result;
  fcl::collide(a.geometry.whole.get(), to_fcl(a.placed.pose), b.geometry.whole.get(),
               to_fcl(b.placed.pose), request, result);
  Axis axis;
  if (result.numContacts() == 0) return axis;
  const fcl::Contactd& contact = result.getContact(0);
  axis.found = contact.normal.allFinite() && is_unit(contact.normal) && contact.pos.allFinite();
  if (!axis.found) return axis;
  axis.normal = contact.normal.normalized();
  axis.witness = contact.pos;
  // FCL may name the opposite.
  axis.found = separation_along(a.placed, b.placed, axis.normal) >=
               separation_along(a.placed, b.placed, -axis.normal);
  return axis;
}

// Where they are apart by FCL's distance; nothing where its points do not say a direction along
// which they are.
std::optional<Axis> gap_axis(const Solid& a, const Solid& b, double range) {
  constexpr double kTiny = 1e-9, kInexact = 1e-3;  // of both widths
  const double size = a.placed.shape.min_extent_m + b.placed.shape.min_extent_m;
  fcl::DistanceRequestd request(true);
  request.distance_tolerance = kTiny * size;
  fcl::DistanceResultd result;
  fcl::distance(a.geometry.whole.get(), to_fcl(a.placed.pose), b.geometry.whole.get(),
                to_fcl(b.placed.pose), request, result);
  if (result.min_distance > range) return Axis{};
  const Vec3 gap = result.nearest_points[1] - result.nearest_points[0];
  const double distance = gap.norm();
  if (!gap.allFinite() || !(distance > kTiny * size)) return std::nullopt;
  const Vec3 normal = gap / distance;
  if (separation_along(a.placed, b.placed, normal) < distance - kInexact * size)
    return std::nullopt;
  return Axis{true, true, normal, 0.5 * (result.nearest_points[0] + result.nearest_points[1])};
}

}  // namespace

namespace {

// ODE's separating-axis test, on boxes inflated by half the range each, so that it also finds the
// axis of boxes that are still apart. Its points are not used: they belong to the inflated boxes.
Axis axis_within(const Solid& a, const Solid& b, double range, StageCounters& counters) {
  const Vec3 inflation = Vec3::Constant(range);
  const Vec3 side_a = 2.0 * a.placed.shape.half_extents_m + inflation;
  const Vec3 side_b = 2.0 * b.placed.shape.half_extents_m + inflation;
  // FCL would say so too, but only after boxes have been copied and room for points been made.
  if (face_separates(a.placed.pose, 0.5 * side_a, b.placed.pose, 0.5 * side_b)) return {};
  ++counters.fcl_calls;
  fcl::Vector3d normal = fcl::Vector3d::Zero();
  double depth = 0.0;
  int code = 0;
  std::vector<fcl::ContactPointd> points;
  points.reserve(8);
  fcl::detail::boxBox2<double>(side_a, to_fcl(a.placed.pose), side_b, to_fcl(b.placed.pose), normal,
                               &depth, &code, 8, points);
  Axis axis;
  if (code < 1 || code > 15 || !normal.allFinite() || !is_unit(normal)) return axis;
  axis.found = true;
  axis.normal = normal;
  if (code <= 6) {
    axis.normal = face_normal(a.placed, b.placed, code, normal);
  } else {
    axis.normal.normalize();
    axis.witness = between_edges(a.placed, (code - 7) / 3, b.placed, (code - 7) % 3, axis.normal);
  }
  return axis;
}

}  // namespace

// Inflated boxes favour faces, which have more points, and may overlap least along quite another
// axis than the boxes do. Where these would seem to overlap though they are apart, or by far more
// than they do, they are looked at as they are.
Axis fcl_box_axis(const Solid& a, const Solid& b, double range, StageCounters& counters) {
  constexpr double kSeems = 0.01, kFarMore = 0.05;  // of the smaller width
  Axis axis = axis_within(a, b, range, counters);
  const double width = std::min(a.placed.shape.min_extent_m, b.placed.shape.min_extent_m);
  const double seems_m = separation_along(a.placed, b.placed, axis.normal);
  if (!axis.found || seems_m >= -kSeems * width) return axis;
  const Axis own = own_box_axis(a, b, range);
  const double own_m = separation_along(a.placed, b.placed, own.normal);
  return own.found && (own_m > 0.0 || own_m > seems_m + kFarMore * width) ? own : axis;
}

Axis fcl_axis(const Solid& a, const Solid& b, double range, StageCounters& counters) {
  ++counters.fcl_calls;
  Axis axis;
  try {
    axis = overlap_axis(a, b);
    if (!axis.found) {
      const std::optional<Axis> gap = gap_axis(a, b, range);
      if (gap && !gap->found) return *gap;
      if (gap) axis = *gap;
    }
  } catch (const std::exception&) {
    axis.found = false;
  }
  if (!axis.found) {
    ++counters.fcl_failures;
    return own_axis(a, b, range);
  }
  refine_by_faces(a, b, kFaceSlack, axis);
  return axis;
}

}  // namespace soda::physics
