#include "physics/continuous/time_of_impact.hpp"

#include <algorithm>
#include <cmath>

#include "physics/continuous/approach.hpp"
#include "physics/continuous/first_touch.hpp"
#include "physics/continuous/mesh_impact.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// Of the smaller body.
double width_of(const SceneDescription& scene, const Geometry& geometry, BodyId a, BodyId b) {
  const double width = shape_of(scene, geometry, a).min_extent_m;
  return is_static(b) ? width : std::min(width, shape_of(scene, geometry, b).min_extent_m);
}

}  // namespace

bool have_met(std::span<const ContactManifold> manifolds, BodyId a, BodyId b) {
  return std::any_of(manifolds.begin(), manifolds.end(), [&](const ContactManifold& m) {
    return m.a == a && m.b == b && !is_joint(m);
  });
}

std::optional<Impact> time_of_unmet_impact(const SceneDescription& scene, const Geometry& geometry,
                                           BodyId a, const BodyState& state_a, BodyId b,
                                           std::span<const ContactManifold> manifolds,
                                           double most_s) {
  if (is_mesh(scene, b))
    return time_of_mesh_impact({scene, geometry, a, state_a, b, most_s}, manifolds);
  if (have_met(manifolds, a, b)) return std::nullopt;
  return time_of_impact(scene, geometry, a, state_a, b, nullptr, most_s);
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
  if (is_mesh(scene, b)) return time_of_mesh_impact({scene, geometry, a, state_a, b, most_s}, {});
  const double apart_s = spheres_apart_s(scene, geometry, a, state_a, b, state_b, most_s);
  if (apart_s > 0.0 && apart_s >= most_s) return std::nullopt;
  FlyingSolids solids(scene, geometry, a, state_a, b, state_b);
  const std::optional<Touch> touch = first_touch(scene,
                                                 {touching_gap_m(scene, geometry, a, state_a, b),
                                                  width_of(scene, geometry, a, b), apart_s, most_s},
                                                 solids);
  return touch ? std::optional(touch->impact) : std::nullopt;
}

void append_way_to_impact(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                          BodyId a, const BodyState& state_a, BodyId b, const BodyState* state_b,
                          std::vector<ContactManifold>& out) {
  if (is_mesh(scene, b)) {
    append_way_to_mesh({scene, geometry, a, state_a, b, dt_s}, out);
    return;
  }
  const double apart_s = spheres_apart_s(scene, geometry, a, state_a, b, state_b, dt_s);
  if (apart_s > 0.0 && apart_s >= dt_s) return;
  FlyingSolids solids(scene, geometry, a, state_a, b, state_b);
  const std::optional<Touch> touch = first_touch(scene,
                                                 {touching_gap_m(scene, geometry, a, state_a, b),
                                                  width_of(scene, geometry, a, b), apart_s, dt_s},
                                                 solids);
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
