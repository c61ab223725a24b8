#include "physics/narrowphase/analytic_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace soda::physics {
namespace {

SurfacePoint nearest_on_box(const Vec3& h, const Vec3& p) {
  const Vec3 clamped = p.cwiseMax(-h).cwiseMin(h);
  const Vec3 out = p - clamped;
  const double distance = out.norm();
  if (distance > 0.0) return {clamped, out / distance, distance};
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (h[i] - std::abs(p[i]) < h[axis] - std::abs(p[axis])) axis = i;
  }
  const double sign = p[axis] >= 0.0 ? 1.0 : -1.0;
  Vec3 on_face = p;
  on_face[axis] = sign * h[axis];
  return {on_face, sign * Vec3::Unit(axis), std::abs(p[axis]) - h[axis]};
}

// Around a core segment on the z axis (a point when its half length is 0).
SurfacePoint nearest_on_rounded(double radius, double half_length, const Vec3& p) {
  const Vec3 core(0.0, 0.0, std::clamp(p.z(), -half_length, half_length));
  const Vec3 out = p - core;
  const double distance = out.norm();
  const Vec3 normal = distance > 0.0 ? Vec3(out / distance) : Vec3(Vec3::UnitX());
  return {core + normal * radius, normal, distance - radius};
}

SurfacePoint nearest_on_cylinder(double radius, double half_length, const Vec3& p) {
  const double radial = std::sqrt(p.x() * p.x() + p.y() * p.y());
  const Vec3 side = radial > 0.0 ? Vec3(p.x() / radial, p.y() / radial, 0.0) : Vec3(Vec3::UnitX());
  const double sign = p.z() >= 0.0 ? 1.0 : -1.0;
  const double beyond_side = radial - radius, beyond_cap = std::abs(p.z()) - half_length;
  if (beyond_side <= 0.0 && beyond_side <= beyond_cap) {
    return {Vec3(p.x(), p.y(), sign * half_length), sign * Vec3::UnitZ(), beyond_cap};
  }
  if (beyond_cap <= 0.0) {
    return {side * radius + Vec3(0.0, 0.0, p.z()), side, beyond_side};
  }
  const Vec3 rim = side * radius + Vec3(0.0, 0.0, sign * half_length);
  const Vec3 out = p - rim;
  const double distance = out.norm();
  return {rim, distance > 0.0 ? Vec3(out / distance) : side, distance};
}

}  // namespace

SurfacePoint nearest_surface(const PlacedShape& s, const Vec3& point) {
  const Vec3 local = s.pose.to_local(point);
  SurfacePoint nearest;
  if (s.shape.kind == ShapeKind::kBox) {
    nearest = nearest_on_box(s.shape.half_extents_m, local);
  } else if (s.shape.kind == ShapeKind::kCylinder) {
    nearest = nearest_on_cylinder(s.shape.radius_m, s.shape.half_length_m, local);
  } else {
    nearest = nearest_on_rounded(s.shape.radius_m, s.shape.half_length_m, local);
  }
  nearest.position = s.pose.to_world(nearest.position);
  nearest.outward = s.pose.rotation * nearest.outward;
  return nearest;
}

PointContact sphere_contact(const PlacedShape& a, const PlacedShape& b, const PairMotion& motion) {
  // Advancing by gap / closing speed along the present normal never passes the impact, because a
  // convex solid stays behind its supporting plane.
  constexpr int kMaxAdvances = 40;
  constexpr double kTouching = 1e-12;  // of the sphere's radius
  const bool first = a.shape.kind == ShapeKind::kSphere;
  const PlacedShape& sphere = first ? a : b;
  const PlacedShape& other = first ? b : a;
  const double radius = sphere.shape.radius_m;
  const Vec3 sign_free = motion.centres_velocity();
  const Vec3 velocity = first ? Vec3(-sign_free) : sign_free;  // of the sphere against the other

  SurfacePoint nearest = nearest_surface(other, sphere.pose.position);
  double gap = nearest.distance_m - radius;
  double time = 0.0;
  if (gap > motion.margin_m) {
    if (gap > motion.range_m) return {};
    for (int i = 0; i < kMaxAdvances && gap > kTouching * radius; ++i) {
      const double closing = -velocity.dot(nearest.outward);
      if (!(closing > 0.0)) return {};
      time += gap / closing;
      if (!(time <= motion.dt_s)) return {};
      nearest = nearest_surface(other, sphere.pose.position + velocity * time);
      gap = nearest.distance_m - radius;
    }
    gap -= velocity.dot(nearest.outward) * time;
  }
  PointContact contact;
  contact.found = true;
  contact.normal = first ? Vec3(-nearest.outward) : nearest.outward;
  contact.separation_m = gap;
  // Within the margin midway between the surfaces; else where the impact meets the other's surface.
  contact.position =
      time > 0.0 ? nearest.position : Vec3(nearest.position + nearest.outward * (0.5 * gap));
  return contact;
}

Vec3 capsule_contacts(const PlacedShape& a, const PlacedShape& b, ContactCandidates& out) {
  const Vec3 along_a = a.pose.rotation.col(2), along_b = b.pose.rotation.col(2);
  const double ha = a.shape.half_length_m, hb = b.shape.half_length_m;
  const Vec3 between = b.pose.position - a.pose.position;
  // Minimise |between + t along_b - s along_a| over the two intervals.
  const double cosine = along_a.dot(along_b);
  const double pa = between.dot(along_a), pb = between.dot(along_b);
  const double sine_squared = 1.0 - cosine * cosine;
  double s = sine_squared > 1e-12 ? std::clamp((pa - pb * cosine) / sine_squared, -ha, ha)
                                  : std::clamp(pa, -ha, ha);
  const double t = std::clamp(s * cosine - pb, -hb, hb);
  s = std::clamp(pa + t * cosine, -ha, ha);
  const Vec3 on_a = a.pose.position + along_a * s, on_b = b.pose.position + along_b * t;
  const Vec3 gap = on_b - on_a;
  const double distance = gap.norm();
  Vec3 normal;
  if (distance > 0.0) {
    normal = gap / distance;
  } else {
    const Vec3 across = along_a.cross(along_b);
    const double length = across.norm();
    normal = length > 1e-6 ? Vec3(across / length) : Vec3(a.pose.rotation.col(0));
  }
  overlap_segments(support_feature(a, normal), support_feature(b, -normal), normal, out);
  if (out.count == 0) {
    const double separation = distance - a.shape.radius_m - b.shape.radius_m;
    out.add(on_a + normal * (a.shape.radius_m + 0.5 * separation), separation, 0);
  }
  return normal;
}

namespace {

// Four points that the lower ones of a tumbling solid are among. Those above them could only be
// reached through them; in a long step they would be within reach, and take their places.
using LowPoints = std::array<std::pair<Vec3, std::uint32_t>, 4>;  // local, with their features

// The corners of the face below the centre: it would tip over any other.
LowPoints low_corners(const CompiledShape& shape, const Vec3& down) {
  int axis = 0;
  down.cwiseAbs().cwiseQuotient(shape.half_extents_m).maxCoeff(&axis);
  const std::uint32_t low = down[axis] > 0.0 ? 1u << axis : 0u;
  LowPoints points;
  int count = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    if ((corner & 1u << axis) != low) continue;
    const Vec3 sign(corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0, corner & 4 ? 1.0 : -1.0);
    points[count++] = {sign.cwiseProduct(shape.half_extents_m), corner};
  }
  return points;
}

// Of a standing cylinder four rim points of the lower cap, one of them the lowest as soon as the
// axis is tilted. Of one whose side is below its centre that opposite to the lowest makes way for
// the other cap's lowest.
LowPoints low_rim_points(const CompiledShape& shape, const Vec3& down) {
  constexpr double kTilt = 1e-3;
  const double radial = std::sqrt(down.x() * down.x() + down.y() * down.y());
  const bool tilted = radial > kTilt;
  const double ux = tilted ? down.x() / radial : 1.0, uy = tilted ? down.y() / radial : 0.0;
  const double r = shape.radius_m, h = down.z() > 0.0 ? shape.half_length_m : -shape.half_length_m;
  const std::uint32_t cap = down.z() > 0.0 ? 0 : 4;
  LowPoints points{{{Vec3(r * ux, r * uy, h), cap},
                    {Vec3(-r * uy, r * ux, h), cap + 1},
                    {Vec3(-r * ux, -r * uy, h), cap + 2},
                    {Vec3(r * uy, -r * ux, h), cap + 3}}};
  if (radial * shape.half_length_m > std::abs(down.z()) * r)
    points[2] = {Vec3(r * ux, r * uy, -h), 4 - cap};
  return points;
}

}  // namespace

Vec3 halfspace_contacts(const PlacedShape& a, const CompiledShape& half_space, const Pose& pose,
                        ContactCandidates& out) {
  const Vec3 up = pose.rotation * half_space.half_space.normal;
  const double offset = half_space.half_space.offset_m + up.dot(pose.position);
  const auto add = [&](const Vec3& point, double radius, std::uint32_t feature) {
    const double separation = up.dot(point) - offset - radius;
    out.add(point - up * (radius + 0.5 * separation), separation, feature);
  };
  const CompiledShape& shape = a.shape;
  switch (shape.kind) {
    case ShapeKind::kSphere:
      add(a.pose.position, shape.radius_m, 0);
      break;
    case ShapeKind::kCapsule:
      for (std::uint32_t end = 0; end < 2; ++end) {
        const Vec3 axis = a.pose.rotation.col(2) * (end == 0 ? -1.0 : 1.0);
        add(a.pose.position + axis * shape.half_length_m, shape.radius_m, end);
      }
      break;
    case ShapeKind::kBox:
      for (const auto& [point, feature] : low_corners(shape, a.pose.direction_to_local(-up)))
        add(a.pose.to_world(point), 0.0, feature);
      break;
    case ShapeKind::kCylinder:
      for (const auto& [point, feature] : low_rim_points(shape, a.pose.direction_to_local(-up)))
        add(a.pose.to_world(point), 0.0, feature);
      break;
    case ShapeKind::kHull: {
      // The corners of the face below the centre and the lowest vertex stand for all, however many
      // there are.
      const SupportFeature face = face_ahead(a, -up);
      const Vec3 lowest = support_point(a, -up);
      bool on_face = false;
      for (int i = 0; i < face.count; ++i) {
        add(face.points[i], 0.0, (face.code + 1) << 6 | static_cast<std::uint32_t>(i));
        on_face = on_face || face.points[i] == lowest;
      }
      if (!on_face) add(lowest, 0.0, 0);
      break;
    }
    default:
      break;
  }
  return -up;
}

}  // namespace soda::physics
