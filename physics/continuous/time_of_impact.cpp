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

bool is_of_spheres(const CompiledShape& shape) {
  if (shape.kind != ShapeKind::kCompound) return shape.kind == ShapeKind::kSphere;
  return std::ranges::all_of(
      shape.parts, [](const CompiledPart& part) { return part.solid->kind == ShapeKind::kSphere; });
}

bool is_of_pair(const ContactManifold& m, BodyId a, BodyId b) {
  return m.a == a && m.b == b && !is_joint(m);
}

bool have_met_parts(std::span<const ContactManifold> manifolds, BodyId a, BodyId b, PartPair parts,
                    const CompiledShape& shape_b) {
  const std::uint32_t number = parts.a * part_count(shape_b) + parts.b;
  return std::ranges::any_of(
      manifolds, [&](const ContactManifold& m) { return is_of_pair(m, a, b) && m.part == number; });
}

std::vector<ContactManifold> of_pair(std::span<const ContactManifold> manifolds, BodyId a,
                                     BodyId b) {
  std::vector<ContactManifold> found;
  for (const ContactManifold& m : manifolds)
    if (is_of_pair(m, a, b)) found.push_back(m);
  return found;
}

}  // namespace

bool have_met(std::span<const ContactManifold> manifolds, BodyId a, BodyId b) {
  return std::any_of(manifolds.begin(), manifolds.end(),
                     [&](const ContactManifold& m) { return m.count > 0 && is_of_pair(m, a, b); });
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
  const bool sphere = is_of_spheres(sa) || is_of_spheres(sb);
  return (sphere ? kSpheres : kOthers) * width_of(scene, geometry, a, b) +
         kRounding * state_a.position_m.cwiseAbs().maxCoeff();
}

namespace {

// Two bodies, or one and a static, of which parts may meet.
struct PairFlight {
  const SceneDescription& scene;
  const Geometry& geometry;
  BodyId a;
  const BodyState& state_a;
  BodyId b;
  const BodyState* state_b;
  double most_s;

  const CompiledShape& shape(BodyId id) const { return shape_of(scene, geometry, id); }
  bool of_compounds() const { return !shape(a).parts.empty() || !shape(b).parts.empty(); }
  MeshFlight with_mesh(std::uint32_t part) const {
    return {scene, geometry, a, state_a, b, most_s, part};
  }
  FlyingSolids solids(PartPair parts) const {
    return {scene, geometry, a, state_a, b, state_b, parts};
  }
};

std::optional<Touch> touch_of(const PairFlight& flight, double apart_s, FlyingSolids& solids) {
  const auto& [scene, geometry, a, state_a, b, state_b, most_s] = flight;
  return first_touch({touching_gap_m(scene, geometry, a, state_a, b),
                      width_of(scene, geometry, a, b), apart_s, most_s},
                     solids);
}

// How long the balls around them are apart.
double apart_s(const PairFlight& flight) {
  return spheres_apart_s(flight.scene, flight.geometry, flight.a, flight.state_a, flight.b,
                         flight.state_b, flight.most_s);
}

// All parts that anything of them can come to.
std::vector<PartPair> parts_in_reach(const PairFlight& flight) {
  const auto& [scene, geometry, a, state_a, b, state_b, most_s] = flight;
  const auto whole = [&](BodyId id, const BodyState* state) -> Solid {
    const GeometryImpl& impl = geometry.impl();
    const StaticGeometry* fixed = is_static(id) ? &impl.statics[static_index_of(id)] : nullptr;
    const ShapeGeometry& shape = impl.shapes[fixed ? fixed->shape : impl.body_shapes[index_of(id)]];
    const Pose pose =
        fixed ? fixed->pose : Pose{state->orientation.toRotationMatrix(), state->position_m};
    return {shape, {shape.shape, {pose.rotation, pose.position - state_a.position_m}}};
  };
  // What turns comes no farther than across itself.
  const auto turned_m = [&](BodyId id, const BodyState& state) {
    const double turn = state.angular_velocity_rad_s.norm() * most_s;
    return shape_of(scene, geometry, id).bounding_radius_m * std::min(2.0 * turn, 2.0);
  };
  Vec3 velocity = state_a.linear_velocity_m_s;
  double range = turned_m(a, state_a) + touching_gap_m(scene, geometry, a, state_a, b);
  if (state_b) {
    velocity -= state_b->linear_velocity_m_s;
    range += turned_m(b, *state_b);
  } else {
    range += 0.5 * scene.gravity_m_s2.norm() * most_s * most_s;
  }
  return near_parts(whole(a, &state_a), whole(b, state_b), range + velocity.norm() * most_s);
}

// The first of parts that no manifold of the pair is of.
std::optional<Impact> impact_of_parts(const PairFlight& flight,
                                      std::span<const ContactManifold> manifolds) {
  const CompiledShape& shape_b = flight.shape(flight.b);
  const bool mesh = shape_b.kind == ShapeKind::kMesh;
  const double apart = mesh ? 0.0 : apart_s(flight);
  if (apart > 0.0 && apart >= flight.most_s) return std::nullopt;
  std::optional<Impact> first;
  for (const PartPair& parts : parts_in_reach(flight)) {
    std::optional<Impact> impact;
    if (mesh) {
      impact = time_of_mesh_impact(flight.with_mesh(parts.a), manifolds);
    } else if (!have_met_parts(manifolds, flight.a, flight.b, parts, shape_b)) {
      FlyingSolids solids = flight.solids(parts);
      const std::optional<Touch> touch = touch_of(flight, apart, solids);
      if (touch) impact = touch->impact;
    }
    // What comes nearer goes before what stays.
    const auto key = [](const Impact& i) { return std::pair(i.time_s, i.lasts); };
    if (impact && (!first || key(*impact) < key(*first))) first = impact;
  }
  return first;
}

}  // namespace

std::optional<Impact> time_of_unmet_impact(const SceneDescription& scene, const Geometry& geometry,
                                           BodyId a, const BodyState& state_a, BodyId b,
                                           std::span<const ContactManifold> manifolds,
                                           double most_s) {
  const PairFlight flight{scene, geometry, a, state_a, b, nullptr, most_s};
  if (flight.of_compounds()) return impact_of_parts(flight, manifolds);
  if (is_mesh(scene, b)) return time_of_mesh_impact(flight.with_mesh(0), manifolds);
  if (have_met(manifolds, a, b)) return std::nullopt;
  return time_of_impact(scene, geometry, a, state_a, b, nullptr, most_s);
}

Separation separation_of(const SceneDescription& scene, const Geometry& geometry, BodyId a,
                         const BodyState& state_a, BodyId b, const BodyState* state_b) {
  const PairFlight flight{scene, geometry, a, state_a, b, state_b, 0.0};
  Separation nearest{Vec3::UnitZ(), 1e300};
  for (std::uint32_t i = 0; i < part_count(flight.shape(a)); ++i)
    for (std::uint32_t k = 0; k < part_count(flight.shape(b)); ++k) {
      const FlyingSolids solids = flight.solids({i, k});
      const Solid &pa = solids.a().solid, &pb = solids.b().solid;
      const Separation apart = separation_between(pa, pb, first_guess(pa, pb));
      if (apart.distance_m < nearest.distance_m || (i == 0 && k == 0)) nearest = apart;
    }
  return nearest;
}

std::optional<Impact> time_of_impact(const SceneDescription& scene, const Geometry& geometry,
                                     BodyId a, const BodyState& state_a, BodyId b,
                                     const BodyState* state_b, double most_s) {
  const PairFlight flight{scene, geometry, a, state_a, b, state_b, most_s};
  if (flight.of_compounds()) return impact_of_parts(flight, {});
  if (is_mesh(scene, b)) return time_of_mesh_impact(flight.with_mesh(0), {});
  const double apart = apart_s(flight);
  if (apart > 0.0 && apart >= most_s) return std::nullopt;
  FlyingSolids solids = flight.solids({});
  const std::optional<Touch> touch = touch_of(flight, apart, solids);
  return touch ? std::optional(touch->impact) : std::nullopt;
}

namespace {

void append_way_of_parts(const PairFlight& flight, double apart, PartPair parts,
                         std::vector<ContactManifold>& out) {
  FlyingSolids solids = flight.solids(parts);
  const std::optional<Touch> touch = touch_of(flight, apart, solids);
  if (!touch || touch->impact.time_s == 0.0) return;
  const FlyingSolids start = flight.solids(parts);
  const Vec3& normal = touch->normal;
  ContactCandidates candidates;
  candidates.add(support_point(solids.a().solid.placed, normal),
                 gap_along(start.a().solid.placed, start.b().solid.placed, normal), kWayToImpact);
  const std::size_t before = out.size();
  emit_manifold(flight.a, flight.b, 0, normal, solids.centre_of_a_m(), candidates, out);
  if (flight.of_compounds())
    number_parts(flight.shape(flight.b), parts, before, out);
  else if (!touch->impact.lasts)
    out.back().impact_s = touch->impact.time_s;
}

void append_ways_of_compounds(const PairFlight& flight, double apart,
                              std::vector<ContactManifold>& out) {
  const CompiledShape& shape_b = flight.shape(flight.b);
  // Those that there are.
  const std::vector<ContactManifold> met = of_pair(out, flight.a, flight.b);
  for (const PartPair& parts : parts_in_reach(flight)) {
    if (shape_b.kind == ShapeKind::kMesh)
      append_way_to_mesh(flight.with_mesh(parts.a), out);
    else if (!have_met_parts(met, flight.a, flight.b, parts, shape_b))
      append_way_of_parts(flight, apart, parts, out);
  }
  const auto of_this = [&](const ContactManifold& m) { return m.a == flight.a && m.b == flight.b; };
  std::sort(std::find_if(out.begin(), out.end(), of_this), out.end(), canonical_before);
}

}  // namespace

void append_way_to_impact(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                          BodyId a, const BodyState& state_a, BodyId b, const BodyState* state_b,
                          std::vector<ContactManifold>& out) {
  const PairFlight flight{scene, geometry, a, state_a, b, state_b, dt_s};
  const bool mesh = is_mesh(scene, b);
  if (mesh && !flight.of_compounds()) return append_way_to_mesh(flight.with_mesh(0), out);
  const double apart = mesh ? 0.0 : apart_s(flight);
  if (apart > 0.0 && apart >= dt_s) return;
  if (flight.of_compounds())
    append_ways_of_compounds(flight, apart, out);
  else
    append_way_of_parts(flight, apart, {}, out);
}

}  // namespace soda::physics
