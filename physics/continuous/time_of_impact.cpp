#include "physics/continuous/time_of_impact.hpp"

#include <algorithm>
#include <cmath>

#include "physics/continuous/approach.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

// Of the smaller body.
double width_of(const SceneDescription& scene, const Geometry& geometry, BodyId a, BodyId b) {
  const double width = shape_of(scene, geometry, a).min_extent_m;
  return is_static(b) ? width : std::min(width, shape_of(scene, geometry, b).min_extent_m);
}

// Whether the direction in which two solids are nearest is known at any gap; else it is lost in
// rounding shortly before they touch.
bool is_known_to_the_end(ShapeKind a, ShapeKind b) {
  const auto simple = [](ShapeKind k) {
    return k == ShapeKind::kSphere || k == ShapeKind::kCapsule;
  };
  const bool boxes = a == ShapeKind::kBox && b == ShapeKind::kBox;
  const bool round = (simple(a) || simple(b)) && a != ShapeKind::kHull && b != ShapeKind::kHull;
  return boxes || round || b == ShapeKind::kHalfSpace;
}

// From the centre of a to that of b.
Vec3 first_guess(const Solid& b) {
  const Vec3& between = b.placed.pose.position;
  return between == Vec3::Zero() ? Vec3(Vec3::UnitZ()) : between;
}

struct Touch {
  Impact impact;
  Vec3 normal = Vec3::UnitZ();
};

// Leaves the solids, which are apart until `time`, at that time.
std::optional<Touch> first_touch(const SceneDescription& scene, double touching_m, double width_m,
                                 double time, double most_s, FlyingSolids& solids) {
  constexpr int kMostAdvances = 200;
  constexpr double kStalled = 1e-9;  // of the whole time
  // Of the smaller body's width: how far bodies that turn while they touch, and that nothing
  // presses on each other, may sink in before they are looked at again.
  constexpr double kSinking = 1e-6;
  // Or of the overlap that there is.
  constexpr double kSinkingMore = 0.01;
  constexpr double kShortOfTouching = 0.1, kMostOfIt = 0.5;
  const Solid &a = solids.a().solid, &b = solids.b().solid;
  const double halt =
      is_known_to_the_end(a.placed.shape.kind, b.placed.shape.kind) ? 0.0 : kShortOfTouching;
  solids.bound_turning();
  // Most pairs that do not meet are seen to from where they are, along the line of their centres.
  Separation now{first_guess(b).normalized(), 0.0};
  if (b.placed.shape.kind != ShapeKind::kHalfSpace)
    now.distance_m = gap_along(a.placed, b.placed, now.normal);
  if (now.distance_m > touching_m) {
    time = std::max(time, solids.apart_s(now, halt * touching_m, most_s).time_s);
    if (time >= most_s) return std::nullopt;
  }
  double full_m = 0.0;
  const Pose* turns_with = nullptr;
  Vec3 normal_local = Vec3::Zero();
  for (int i = 0; i < kMostAdvances; ++i) {
    solids.go_to(time);
    if (turns_with) now.normal = turns_with->rotation * normal_local;
    // Most of a gap that is left along the direction it was found in is good enough.
    now.distance_m = full_m > touching_m ? gap_along(a.placed, b.placed, now.normal) : 0.0;
    if (!(now.distance_m > kMostOfIt * full_m)) {
      now = separation_between(a, b, now.normal);
      full_m = now.distance_m;
    }
    const bool touches = now.distance_m <= touching_m;
    const double rounding = 1e-14 * solids.velocity().norm();
    if (touches && solids.approach_m_s(now.normal, touching_m) > rounding)
      return Touch{{time, false}, now.normal};
    const bool pressed = solids.is_static_b() && now.normal.dot(scene.gravity_m_s2) > 0.0;
    const double deeper =
        pressed ? touching_m : std::max(kSinking * width_m, -kSinkingMore * now.distance_m);
    const double floor = touches ? std::min(now.distance_m, 0.0) - deeper : halt * touching_m;
    const FlyingSolids::Wait safe = solids.apart_s(now, floor, most_s - time);
    if (safe.time_s >= most_s - time) return std::nullopt;
    if (safe.time_s <= kStalled * most_s && touches) return Touch{{time, true}, now.normal};
    time += safe.time_s;
    turns_with = safe.with ? &safe.with->solid.placed.pose : nullptr;
    if (turns_with) normal_local = turns_with->direction_to_local(now.normal);
    now.normal = (now.normal + safe.time_s * safe.drift_1_s).normalized();
  }
  return Touch{{time, true}, now.normal};
}

}  // namespace

bool have_met(std::span<const ContactManifold> manifolds, BodyId a, BodyId b) {
  return std::any_of(manifolds.begin(), manifolds.end(), [&](const ContactManifold& m) {
    return m.a == a && m.b == b && !is_joint(m);
  });
}

bool is_mesh(const SceneDescription& scene, BodyId id) {
  return is_static(id) && std::holds_alternative<TriangleMesh>(
                              scene.shapes[scene.statics[static_index_of(id)].shape]);
}

double touching_gap_m(const SceneDescription& scene, const Geometry& geometry, BodyId a,
                      const BodyState& state_a, BodyId b) {
  constexpr double kSpheres = 1e-14, kOthers = 1e-8, kRounding = 1e-15;
  const CompiledShape& sa = shape_of(scene, geometry, a);
  const CompiledShape& sb = shape_of(scene, geometry, b);
  const bool sphere = sa.kind == ShapeKind::kSphere || sb.kind == ShapeKind::kSphere;
  return (sphere ? kSpheres : kOthers) * width_of(scene, geometry, a, b) +
         kRounding * state_a.position_m.cwiseAbs().maxCoeff();
}

Separation separation_of(const SceneDescription& scene, const Geometry& geometry, BodyId a,
                         const BodyState& state_a, BodyId b, const BodyState* state_b) {
  const FlyingSolids solids(scene, geometry, a, state_a, b, state_b);
  return separation_between(solids.a().solid, solids.b().solid, first_guess(solids.b().solid));
}

std::optional<Impact> time_of_impact(const SceneDescription& scene, const Geometry& geometry,
                                     BodyId a, const BodyState& state_a, BodyId b,
                                     const BodyState* state_b, double most_s) {
  const double apart_s = spheres_apart_s(scene, geometry, a, state_a, b, state_b, most_s);
  if (apart_s > 0.0 && apart_s >= most_s) return std::nullopt;
  FlyingSolids solids(scene, geometry, a, state_a, b, state_b);
  const std::optional<Touch> touch =
      first_touch(scene, touching_gap_m(scene, geometry, a, state_a, b),
                  width_of(scene, geometry, a, b), apart_s, most_s, solids);
  return touch ? std::optional(touch->impact) : std::nullopt;
}

void append_way_to_impact(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                          BodyId a, const BodyState& state_a, BodyId b, const BodyState* state_b,
                          std::vector<ContactManifold>& out) {
  const double apart_s = spheres_apart_s(scene, geometry, a, state_a, b, state_b, dt_s);
  if (apart_s > 0.0 && apart_s >= dt_s) return;
  FlyingSolids solids(scene, geometry, a, state_a, b, state_b);
  const std::optional<Touch> touch =
      first_touch(scene, touching_gap_m(scene, geometry, a, state_a, b),
                  width_of(scene, geometry, a, b), apart_s, dt_s, solids);
  if (!touch || touch->impact.time_s == 0.0) return;
  const FlyingSolids start(scene, geometry, a, state_a, b, state_b);
  const Vec3& normal = touch->normal;
  ContactCandidates candidates;
  candidates.add(support_point(solids.a().solid.placed, normal),
                 gap_along(start.a().solid.placed, start.b().solid.placed, normal), kWayToImpact);
  emit_manifold(a, b, 0, normal, solids.centre_of_a_m(), candidates, out);
  if (!touch->impact.lasts) out.back().impact_s = touch->impact.time_s;
}

}  // namespace soda::physics
