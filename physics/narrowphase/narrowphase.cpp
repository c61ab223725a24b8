#include <algorithm>
#include <cmath>

#include "physics/model/contact_manifold.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/narrowphase/analytic_contacts.hpp"
#include "physics/narrowphase/contact_axis.hpp"
#include "physics/narrowphase/mesh_contacts.hpp"
#include "physics/narrowphase/near_triangles.hpp"
#include "physics/narrowphase/part_pairs.hpp"
#include "physics/narrowphase/seams.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/shapes/geometry_impl.hpp"

// FCL or own code says along which axis two solids meet; the contact points then come from the true
// shapes, by their supporting features along that axis. So what is inexact in an axis (depths of
// curved shapes, one point per pair) does not reach the solver.
namespace soda::physics {
namespace {

// Points from the features that the shapes show to each other along the axis.
void add_feature_points(const Solid& a, const Solid& b, const Axis& axis, double range,
                        Vec3& normal, ContactCandidates& out) {
  constexpr std::uint32_t kOfB = 0x80000000u, kNearest = 0x40000000u;
  const auto number_as_of_b = [&out] {
    for (int i = 0; i < out.count; ++i) out.points[i].feature |= kOfB;
  };
  const SupportFeature fa = support_feature(a.placed, axis.normal);
  const SupportFeature fb = support_feature(b.placed, -axis.normal);
  normal = axis.normal;
  const auto apart = [&] { return separation_along(a.placed, b.placed, normal); };
  if (is_along(fa, normal)) {
    normal = fa.normal;
    clip_to_reference(fa, fb, out);
  } else if (is_along(fb, -normal)) {
    normal = -fb.normal;
    clip_to_reference(fb, fa, out);
    number_as_of_b();
  } else if (is_over(fa, normal) && fa.normal.dot(normal) >= -fb.normal.dot(normal)) {
    clip_over(fa, fb, normal, apart(), out);
  } else if (is_over(fb, -normal)) {
    clip_over(fb, fa, -normal, apart(), out);
    number_as_of_b();
  } else {
    overlap_segments(fa, fb, normal, out);
  }
  double least = 1e300;
  for (int i = 0; i < out.count; ++i) least = std::min(least, out.points[i].separation_m);
  if (least <= range && !axis.nearest) return;
  // What is nearest may lie beyond a face's edge, where features are cut off.
  constexpr double kCutOff = 1e-3;  // of the smaller width
  const double separation = apart();
  const double width = std::min(a.placed.shape.min_extent_m, b.placed.shape.min_extent_m);
  if (least <= range && least <= separation + kCutOff * width) return;
  if (least > range) out.count = 0;
  if (separation <= range) out.add(axis.witness, separation, kNearest);
}

// Along which two solids meet.
Axis axis_of(Narrowphase narrowphase, ShapeKernel kernel, const Solid& a, const Solid& b,
             double range, StageCounters& counters) {
  const bool boxes = kernel == ShapeKernel::kBoxBox;
  if (!is_asked_of_fcl(narrowphase, kernel))
    return boxes ? own_box_axis(a, b, range) : own_axis(a, b, range);
  return boxes ? fcl_box_axis(a, b, range, counters) : fcl_axis(a, b, range, counters);
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

// A pair where it is, relative to the centre of a.
struct PlacedPair {
  Solid a, b;
  ShapeKernel kernel;
};

PairMotion motion_of(const PairStep& pair, const PlacedPair& placed) {
  const CompiledShape &shape_a = placed.a.placed.shape, &shape_b = placed.b.placed.shape;
  const BodyState &a = pair.state_a, *b = pair.state_b;
  const Vec3 pull_m_s2 = -relative_field(pair.scene, pair.a, pair.b);
  const double dt_s = pair.dt_s;
  PairMotion motion;
  motion.velocity_a = a.linear_velocity_m_s;
  motion.angular_velocity_a = a.angular_velocity_rad_s;
  motion.center_b = placed.b.placed.pose.position;
  motion.dt_s = dt_s;
  double extent = shape_a.min_extent_m;
  double turning = motion.angular_velocity_a.norm() * shape_a.bounding_radius_m;
  double shows = shape_a.kind == ShapeKind::kSphere ? 0.0 : turning;  // other features
  if (b != nullptr) {
    motion.velocity_b = b->linear_velocity_m_s;
    motion.angular_velocity_b = b->angular_velocity_rad_s;
    extent = std::min(extent, shape_b.min_extent_m);
    const double of_b = motion.angular_velocity_b.norm() * shape_b.bounding_radius_m;
    turning += of_b;
    shows += shape_b.kind == ShapeKind::kSphere ? 0.0 : of_b;
  }
  motion.pulled_m_s = pull_m_s2 * dt_s;
  if (b == nullptr || pull_m_s2 != Vec3::Zero()) motion.velocity_a += motion.pulled_m_s;
  motion.margin_m = kContactMargin * extent;
  motion.rotation_m = shows * dt_s;
  const double speed = (motion.velocity_b - motion.velocity_a).norm() + turning;
  motion.range_m = std::min(motion.margin_m + speed * dt_s, 1e300);
  return motion;
}

// Solids other than spheres look ahead by no more than their own width: what a contact normal of
// the present pose says about a longer path is not worth having.
double limited_range(const PairMotion& motion) {
  return std::min(motion.range_m, motion.margin_m * (1.0 / kContactMargin));
}

PlacedPair place_pair(const PairStep& pair) {
  const auto& [scene, geometry, dt_s, a, state_a, b, state_b] = pair;
  const GeometryImpl& impl = geometry.impl();
  const StaticGeometry* fixed = is_static(b) ? &impl.statics[static_index_of(b)] : nullptr;
  const ShapeGeometry& ga = impl.shapes[impl.body_shapes[index_of(a)]];
  const ShapeGeometry& gb = impl.shapes[fixed ? fixed->shape : impl.body_shapes[index_of(b)]];
  const Vec3 center_b = (fixed ? fixed->pose.position : state_b->position_m) - state_a.position_m;
  const Mat3 rotation_b = fixed ? fixed->pose.rotation : state_b->orientation.toRotationMatrix();
  return {{ga, {ga.shape, {state_a.orientation.toRotationMatrix(), Vec3::Zero()}}},
          {gb, {gb.shape, {rotation_b, center_b}}},
          kernel_of(ga.shape.kind, gb.shape.kind)};
}

// The placed pair, here and below: the bodies, or parts of them.
void collide_solids(const PairStep& pair, const PlacedPair& placed, const PairMotion& motion,
                    std::vector<ContactManifold>& out, StageCounters& counters) {
  const Solid &a = placed.a, &b = placed.b;
  const Narrowphase narrowphase = pair.scene.narrowphase;
  const Vec3& origin = pair.state_a.position_m;
  ContactCandidates candidates;
  Vec3 normal = Vec3::UnitZ();
  const double range = limited_range(motion);
  const bool sphere =
      a.placed.shape.kind == ShapeKind::kSphere || b.placed.shape.kind == ShapeKind::kSphere;
  const bool closed_form =
      placed.kernel == ShapeKernel::kAnalytic && !is_asked_of_fcl(narrowphase, placed.kernel);
  if (closed_form && sphere) {
    const PointContact contact = sphere_contact(a.placed, b.placed, motion);
    if (!contact.found) return;
    if (slides_past(a.placed, b.placed, contact.normal, contact.position, motion)) return;
    candidates.add(contact.position, contact.separation_m, 0);
    emit_manifold(pair, 0, contact.normal, origin, candidates, out);
    return;
  }
  if (closed_form) {
    normal = capsule_contacts(a.placed, b.placed, candidates);
  } else {
    const Axis axis = axis_of(narrowphase, placed.kernel, a, b, range, counters);
    if (!axis.found) return;
    add_feature_points(a, b, axis, range, normal, candidates);
  }
  keep_reached(motion, normal, candidates);
  if (candidates.count > 0 &&
      slides_past(a.placed, b.placed, normal, candidates.points[0].position_m, motion))
    return;
  emit_manifold(pair, 0, normal, origin, candidates, out);
}

// No compounds.
void collide_placed(const PairStep& pair, const PlacedPair& placed, const PairMotion& motion,
                    std::vector<ContactManifold>& out, StageCounters& counters) {
  const PlacedShape &a = placed.a.placed, &b = placed.b.placed;
  ++counters.narrowphase_tests[static_cast<std::size_t>(placed.kernel)];
  if (b.shape.kind == ShapeKind::kHalfSpace) {
    ContactCandidates candidates;
    const Vec3 normal = halfspace_contacts(a, b.shape, b.pose, candidates);
    keep_reached(motion, normal, candidates);
    emit_manifold(pair, 0, normal, pair.state_a.position_m, candidates, out);
  } else if (placed.kernel == ShapeKernel::kMesh) {
    mesh_contacts({pair, a, b, motion}, near_triangles(a, b, limited_range(motion)), out);
  } else {
    collide_solids(pair, placed, motion, out, counters);
  }
}

// A ball that goes round a centre is not on a straight path: it looks no farther ahead than others.
PairMotion motion_of_parts(const PairMotion& whole, const PlacedPair& pair) {
  PairMotion motion = whole;
  motion.arm_a = pair.a.placed.pose.position;
  motion.arm_b = pair.b.placed.pose.position - whole.center_b;
  if (motion.is_off_centre()) motion.range_m = limited_range(whole);
  return motion;
}

void collide_compounds(const PairStep& pair, const PlacedPair& whole, const PairMotion& motion,
                       std::vector<ContactManifold>& out, StageCounters& counters) {
  const GeometryImpl& impl = pair.geometry.impl();
  const std::size_t begin = out.size();
  for (const PartPair& parts : near_parts(whole.a, whole.b, limited_range(motion))) {
    const Solid a = part_of(impl, whole.a, parts.a), b = part_of(impl, whole.b, parts.b);
    const PlacedPair placed{a, b, kernel_of(a.placed.shape.kind, b.placed.shape.kind)};
    const std::size_t before = out.size();
    collide_placed(pair, placed, motion_of_parts(motion, placed), out, counters);
    number_parts(whole.b.placed.shape, parts, before, out);
  }
  std::sort(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end(), canonical_before);
}

}  // namespace

ShapeKernel kernel_for(const Shape& a, const Shape& b) {
  return kernel_of(static_cast<ShapeKind>(a.index()), static_cast<ShapeKind>(b.index()));
}

bool is_asked_of_fcl(Narrowphase narrowphase, ShapeKernel kernel) {
  if (kernel == ShapeKernel::kHalfSpace || kernel == ShapeKernel::kMesh) return false;
  return narrowphase == Narrowphase::kFcl ||
         (narrowphase == Narrowphase::kAuto && kernel == ShapeKernel::kBoxBox);
}

bool append_manifolds(const PairStep& pair, std::vector<ContactManifold>& out,
                      StageCounters& counters) {
  const PlacedPair placed = place_pair(pair);
  const PairMotion motion = motion_of(pair, placed);
  const std::size_t before = out.size();
  const bool compound =
      !placed.a.placed.shape.parts.empty() || !placed.b.placed.shape.parts.empty();
  if (compound)
    collide_compounds(pair, placed, motion, out, counters);
  else
    collide_placed(pair, placed, motion, out, counters);
  // Of a mesh, and of compounds, other parts may be met; and what turns far shows other features.
  const bool none = out.size() == before;
  return (none && motion.rotation_m > motion.margin_m) ||
         ((none || compound || placed.kernel == ShapeKernel::kMesh) &&
          motion.range_m > limited_range(motion));
}

}  // namespace soda::physics
