#include <fcl/geometry/collision_geometry.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/box_box.h>

#include <algorithm>
#include <cmath>

#include "physics/model/contact_manifold.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/narrowphase/analytic_contacts.hpp"
#include "physics/narrowphase/core_distance.hpp"
#include "physics/narrowphase/mesh_contacts.hpp"
#include "physics/narrowphase/near_triangles.hpp"
#include "physics/narrowphase/separating_faces.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/shapes/geometry_impl.hpp"

// FCL says along which axis two solids meet; the contact points then come from the true shapes, by
// their supporting features along that axis. So what is inexact in FCL's answer (depths of curved
// shapes, one point per pair) does not reach the solver.
namespace soda::physics {
namespace {

fcl::Transform3d to_fcl(const Pose& pose) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = pose.rotation;
  transform.translation() = pose.position;
  return transform;
}

// Where and along which direction (from a to b) two solids meet.
struct Axis {
  bool found = false;
  bool nearest =
      false;  // the solids are nearest to each other along it, or along a face about as near
  Vec3 normal = Vec3::UnitZ();
  Vec3 witness = Vec3::Zero();  // a point between the surfaces
};

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

// The exact column that FCL names, with FCL's sign. Where faces of both boxes serve as well,
// rounding decides which one FCL names; then it is always the first box's, so that features do not
// flicker.
Vec3 face_normal(const PlacedShape& a, const PlacedShape& b, int code, const Vec3& fcl_normal) {
  constexpr double kSlack = 1e-3;      // of the smaller width
  constexpr double kParallel = 0.999;  // cosine
  const Pose& pose = code <= 3 ? a.pose : b.pose;
  const Vec3 column = pose.rotation.col((code - 1) % 3);
  const Vec3 normal = column.dot(fcl_normal) >= 0.0 ? column : Vec3(-column);
  if (code <= 3) return normal;
  const Vec3 of_a = support_feature(a, normal).normal;
  if (of_a.dot(normal) < kParallel) return normal;
  const double slack = kSlack * std::min(a.shape.min_extent_m, b.shape.min_extent_m);
  return separation_along(a, b, of_a) > separation_along(a, b, normal) - slack ? of_a : normal;
}

// ODE's separating-axis test, on boxes inflated by half the range each, so that it also finds the
// axis of boxes that are still apart. Its points are not used: they belong to the inflated boxes.
Axis box_box_axis(const Solid& a, const Solid& b, double range) {
  const Vec3 inflation = Vec3::Constant(range);
  const Vec3 side_a = 2.0 * a.placed.shape.half_extents_m + inflation;
  const Vec3 side_b = 2.0 * b.placed.shape.half_extents_m + inflation;
  // FCL would say so too, but only after boxes have been copied and room for points been made.
  if (face_separates(a.placed.pose, 0.5 * side_a, b.placed.pose, 0.5 * side_b)) return {};
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

// Overlap side: MPR on the whole shapes. Its normal is a seed only.
Axis penetration_axis(const Solid& a, const Solid& b) {
  fcl::CollisionRequestd request(1, true);
  fcl::CollisionResultd result;
  fcl::collide(a.geometry.whole.get(), to_fcl(a.placed.pose), b.geometry.whole.get(),
               to_fcl(b.placed.pose), request, result);
  Axis axis;
  if (result.numContacts() == 0) return axis;
  const fcl::Contactd& contact = result.getContact(0);
  if (!contact.normal.allFinite() || !is_unit(contact.normal) || !contact.pos.allFinite()) {
    return axis;
  }
  axis.found = true;
  axis.normal = contact.normal.normalized();
  axis.witness = contact.pos;
  return axis;
}

// Replaces the axis by a face normal of either shape that separates more (or as much, within a
// tolerance that favours faces): corrects MPR's wrong faces and gives face contacts an exact
// normal.
void refine_by_faces(const Solid& a, const Solid& b, Axis& axis) {
  constexpr double kFacePreference = 0.05;  // of the depth
  constexpr double kFaceSlack = 1e-4;       // of the smaller width
  const double slack =
      kFaceSlack * std::min(a.placed.shape.min_extent_m, b.placed.shape.min_extent_m);
  double best = axis.found ? separation_along(a.placed, b.placed, axis.normal) : -1e300;
  best -= slack + kFacePreference * std::max(0.0, -best);
  const auto consider = [&](const PlacedShape& owner, const PlacedShape& other,
                            const FacePlane& face, double sign) {
    const Vec3 outward = owner.pose.rotation * face.normal;
    // The other's centre is one of its points: its height over the face bounds the separation.
    const double bound = outward.dot(other.pose.position - owner.pose.position) - face.offset_m;
    if (bound <= best) return;
    const Vec3 normal = sign * outward;
    const double separation = separation_along(a.placed, b.placed, normal);
    if (separation > best) best = separation, axis.normal = normal, axis.found = true;
  };
  const auto consider_all = [&](const PlacedShape& owner, const PlacedShape& other, double sign) {
    for (const FacePlane& face : owner.shape.face_planes) consider(owner, other, face, sign);
  };
  consider_all(a.placed, b.placed, 1.0);
  consider_all(b.placed, a.placed, -1.0);
}

Axis convex_axis(const Solid& a, const Solid& b, double range) {
  bool cores_overlap = false;
  Axis axis = core_axis(a, b, range, cores_overlap);
  if (!cores_overlap && !axis.found) return axis;
  if (cores_overlap) axis = penetration_axis(a, b);
  const Vec3 between = b.placed.pose.position - a.placed.pose.position;
  if (!axis.found) axis.witness = 0.5 * between;
  refine_by_faces(a, b, axis);
  if (axis.found) return axis;
  // Coincident round shapes: no direction is better than another.
  const double distance = between.norm();
  axis.normal = distance > 0.0 ? Vec3(between / distance) : Vec3(Vec3::UnitZ());
  axis.found = true;
  return axis;
}

// Points from the features that the shapes show to each other along the axis.
void add_feature_points(const Solid& a, const Solid& b, const Axis& axis, double range,
                        Vec3& normal, ContactCandidates& out) {
  constexpr double kAligned = 1.0 - 1e-9;
  const SupportFeature fa = support_feature(a.placed, axis.normal);
  const SupportFeature fb = support_feature(b.placed, -axis.normal);
  normal = axis.normal;
  if (fa.count > 2 && fa.normal.dot(axis.normal) > kAligned) {
    normal = fa.normal;
    clip_to_reference(fa, fb, out);
  } else if (fb.count > 2 && -fb.normal.dot(axis.normal) > kAligned) {
    normal = -fb.normal;
    clip_to_reference(fb, fa, out);
    for (int i = 0; i < out.count; ++i) out.points[i].feature |= 0x80000000u;
  } else {
    overlap_segments(fa, fb, normal, out);
  }
  double least = 1e300;
  for (int i = 0; i < out.count; ++i) least = std::min(least, out.points[i].separation_m);
  if (least <= range && !axis.nearest) return;
  // What is nearest may lie beyond a face's edge, where features are cut off.
  constexpr double kCutOff = 1e-3;  // of the smaller width
  const double separation = separation_along(a.placed, b.placed, normal);
  const double width = std::min(a.placed.shape.min_extent_m, b.placed.shape.min_extent_m);
  if (least <= range && least <= separation + kCutOff * width) return;
  if (least > range) out.count = 0;
  if (separation <= range) out.add(axis.witness, separation, 0x40000000u);
}

ShapeKernel kernel_of(ShapeKind a, ShapeKind b) {
  const auto either = [&](ShapeKind kind) { return a == kind || b == kind; };
  const auto both = [&](ShapeKind kind) { return a == kind && b == kind; };
  const auto polytope = [](ShapeKind k) { return k == ShapeKind::kBox || k == ShapeKind::kHull; };
  if (either(ShapeKind::kMesh)) return ShapeKernel::kMesh;
  if (either(ShapeKind::kSphere)) {
    return either(ShapeKind::kHull) ? ShapeKernel::kCore : ShapeKernel::kAnalytic;
  }
  if (either(ShapeKind::kHalfSpace)) return ShapeKernel::kHalfSpace;
  if (both(ShapeKind::kCapsule)) return ShapeKernel::kAnalytic;
  if (both(ShapeKind::kBox)) return ShapeKernel::kBoxBox;
  return polytope(a) && polytope(b) ? ShapeKernel::kPolytopeClip : ShapeKernel::kCore;
}

PairMotion motion_of(const SceneDescription& scene, double dt_s, const BodyState& a,
                     const BodyState* b, const CompiledShape& shape_a, const CompiledShape& shape_b,
                     const Vec3& center_b) {
  PairMotion motion;
  motion.velocity_a = a.linear_velocity_m_s;
  motion.spin_a = a.angular_velocity_rad_s;
  motion.center_b = center_b;
  motion.dt_s = dt_s;
  double extent = shape_a.min_extent_m;
  double turning = motion.spin_a.norm() * shape_a.bounding_radius_m;
  if (b != nullptr) {
    motion.velocity_b = b->linear_velocity_m_s;
    motion.spin_b = b->angular_velocity_rad_s;
    extent = std::min(extent, shape_b.min_extent_m);
    turning += motion.spin_b.norm() * shape_b.bounding_radius_m;
  } else {
    motion.velocity_a += scene.gravity_m_s2 * dt_s;
  }
  motion.margin_m = kContactMargin * extent;
  const double speed = (motion.velocity_b - motion.velocity_a).norm() + turning;
  motion.range_m = std::min(motion.margin_m + speed * dt_s, 1e300);
  return motion;
}

// Solids other than spheres look ahead by no more than their own width: what a contact normal of
// the present pose says about a longer way is not worth having.
double limited_range(const PairMotion& motion) {
  return std::min(motion.range_m, motion.margin_m * (1.0 / kContactMargin));
}

void collide_solids(ShapeKernel kernel, BodyId id_a, const Solid& a, BodyId id_b, const Solid& b,
                    const PairMotion& motion, const Vec3& origin,
                    std::vector<ContactManifold>& out) {
  ContactCandidates candidates;
  Vec3 normal = Vec3::UnitZ();
  const double range = limited_range(motion);
  const bool sphere =
      a.placed.shape.kind == ShapeKind::kSphere || b.placed.shape.kind == ShapeKind::kSphere;
  if (kernel == ShapeKernel::kAnalytic && sphere) {
    const PointContact contact = sphere_contact(a.placed, b.placed, motion);
    if (!contact.found) return;
    candidates.add(contact.position, contact.separation_m, 0);
    emit_manifold(id_a, id_b, 0, contact.normal, origin, candidates, out);
    return;
  }
  if (kernel == ShapeKernel::kAnalytic) {
    normal = capsule_contacts(a.placed, b.placed, candidates);
  } else {
    const Axis axis =
        kernel == ShapeKernel::kBoxBox ? box_box_axis(a, b, range) : convex_axis(a, b, range);
    if (!axis.found) return;
    add_feature_points(a, b, axis, range, normal, candidates);
  }
  keep_reached(motion, normal, candidates);
  emit_manifold(id_a, id_b, 0, normal, origin, candidates, out);
}

// A pair where it is, relative to the centre of a.
struct PlacedPair {
  Solid a, b;
  ShapeKernel kernel;
};

PlacedPair place_pair(const Geometry& geometry, BodyId a, const BodyState& state_a, BodyId b,
                      const BodyState* state_b) {
  const GeometryImpl& impl = geometry.impl();
  const StaticGeometry* fixed = is_static(b) ? &impl.statics[static_index_of(b)] : nullptr;
  const ShapeGeometry& ga = impl.shapes[impl.body_shapes[index_of(a)]];
  const ShapeGeometry& gb = impl.shapes[fixed ? fixed->shape : impl.body_shapes[index_of(b)]];
  const Vec3 center_b = (fixed ? fixed->pose.position : state_b->position_m) - state_a.position_m;
  const Mat3 turn_b = fixed ? fixed->pose.rotation : state_b->orientation.toRotationMatrix();
  return {{ga, {ga.shape, {state_a.orientation.toRotationMatrix(), Vec3::Zero()}}},
          {gb, {gb.shape, {turn_b, center_b}}},
          kernel_of(ga.shape.kind, gb.shape.kind)};
}

}  // namespace

ShapeKernel kernel_for(const Shape& a, const Shape& b) {
  return kernel_of(static_cast<ShapeKind>(a.index()), static_cast<ShapeKind>(b.index()));
}

bool append_manifolds(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                      BodyId a, const BodyState& state_a, BodyId b, const BodyState* state_b,
                      std::vector<ContactManifold>& out, StageCounters& counters) {
  const PlacedPair pair = place_pair(geometry, a, state_a, b, state_b);
  const CompiledShape& shape_b = pair.b.placed.shape;
  const Vec3& origin = state_a.position_m;
  const PairMotion motion = motion_of(scene, dt_s, state_a, state_b, pair.a.placed.shape, shape_b,
                                      pair.b.placed.pose.position);
  ++counters.narrowphase_tests[static_cast<std::size_t>(pair.kernel)];
  const std::size_t before = out.size();
  if (shape_b.kind == ShapeKind::kHalfSpace) {
    ContactCandidates candidates;
    const Vec3 normal = halfspace_contacts(pair.a.placed, shape_b, pair.b.placed.pose, candidates);
    keep_reached(motion, normal, candidates);
    emit_manifold(a, b, 0, normal, origin, candidates, out);
  } else if (pair.kernel == ShapeKernel::kMesh) {
    mesh_contacts(a, b, pair.a.placed, pair.b.placed,
                  near_triangles(pair.a.placed, pair.b.placed, limited_range(motion)), motion,
                  origin, out);
  } else {
    collide_solids(pair.kernel, a, pair.a, b, pair.b, motion, origin, out);
  }
  // Of a mesh other parts may be met.
  return (out.size() == before || pair.kernel == ShapeKernel::kMesh) &&
         motion.range_m > limited_range(motion);
}

Separation overlap_between(const Solid& a, const Solid& b) {
  const Vec3 normal = convex_axis(a, b, 1e300).normal;
  return {normal, separation_along(a.placed, b.placed, normal)};
}

}  // namespace soda::physics
