#include "physics/continuous/time_of_impact.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "physics/continuous/conservative_advancement.hpp"
#include "physics/continuous/first_touch.hpp"
#include "physics/continuous/mesh_impact.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

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

bool is_mesh(const SceneDescription& scene, BodyId id) {
  return is_static(id) && std::holds_alternative<TriangleMesh>(
                              scene.shapes[scene.statics[static_index_of(id)].shape]);
}

double overlap_m(const PairStep& pair, StageCounters& counters) {
  if (!is_mesh(pair.scene, pair.b)) return std::max(0.0, -separation_of(pair).distance_m);
  std::vector<ContactManifold> found;
  const auto& [scene, geometry, dt_s, a, state_a, b, state_b] = pair;
  collide({scene, geometry, 0.0, a, state_a, b, state_b}, found, counters);
  double overlap = 0.0;
  for (const ContactManifold& m : found) overlap = std::max(overlap, -least_separation_m(m));
  return overlap;
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

// Whether parts of them may meet: either is a compound.
bool is_of_compounds(const PairStep& pair) {
  return !shape_of_a(pair).parts.empty() || !shape_of_b(pair).parts.empty();
}

std::optional<Touch> touch_of(const PairStep& pair, double apart_s, FlyingSolids& solids) {
  const auto& [scene, geometry, most_s, a, state_a, b, state_b] = pair;
  return first_touch({touching_gap_m(scene, geometry, a, state_a, b),
                      width_of(scene, geometry, a, b), apart_s, most_s},
                     solids);
}

// All parts that anything of them can come to.
std::vector<PartPair> parts_in_reach(const PairStep& pair) {
  const auto& [scene, geometry, most_s, a, state_a, b, state_b] = pair;
  const auto whole = [&geometry = geometry, &state_a = state_a](BodyId id,
                                                                const BodyState* state) -> Solid {
    const GeometryImpl& impl = geometry.impl();
    const StaticGeometry* fixed = is_static(id) ? &impl.statics[static_index_of(id)] : nullptr;
    const ShapeGeometry& shape = impl.shapes[fixed ? fixed->shape : impl.body_shapes[index_of(id)]];
    const Pose pose =
        fixed ? fixed->pose : Pose{state->orientation.toRotationMatrix(), state->position_m};
    return {shape, {shape.shape, {pose.rotation, pose.position - state_a.position_m}}};
  };
  // What turns comes no farther than across itself.
  const auto turned_m = [&scene = scene, &geometry = geometry, most_s = most_s](
                            BodyId id, const BodyState& state) {
    const double rotation = state.angular_velocity_rad_s.norm() * most_s;
    return shape_of(scene, geometry, id).bounding_radius_m * std::min(2.0 * rotation, 2.0);
  };
  Vec3 velocity = state_a.linear_velocity_m_s;
  double range = turned_m(a, state_a) + touching_gap_m(scene, geometry, a, state_a, b);
  if (state_b) {
    velocity -= state_b->linear_velocity_m_s;
    range += turned_m(b, *state_b);
  }
  range += 0.5 * relative_field(scene, a, b).norm() * most_s * most_s;
  return near_parts(whole(a, &state_a), whole(b, state_b), range + velocity.norm() * most_s);
}

// The first of all pairs of parts.
std::optional<Impact> impact_of_parts(const PairStep& pair) {
  const CompiledShape& shape_b = shape_of_b(pair);
  const bool mesh = shape_b.kind == ShapeKind::kMesh;
  const double apart = mesh ? 0.0 : spheres_apart_s(pair);
  if (apart > 0.0 && apart >= pair.dt_s) return std::nullopt;
  std::optional<Impact> first;
  for (const PartPair& parts : parts_in_reach(pair)) {
    std::optional<Impact> impact;
    if (mesh) {
      impact = time_of_mesh_impact(pair, parts.a);
    } else {
      FlyingSolids solids(pair, parts);
      const std::optional<Touch> touch = touch_of(pair, apart, solids);
      if (touch) impact = touch->impact;
    }
    // What comes nearer goes before what stays.
    const auto key = [](const Impact& i) { return std::pair(i.time_s, i.lasts); };
    if (impact && (!first || key(*impact) < key(*first))) first = impact;
  }
  return first;
}

}  // namespace

Separation separation_of(const PairStep& pair) {
  Separation nearest{Vec3::UnitZ(), 1e300};
  for (std::uint32_t i = 0; i < part_count(shape_of_a(pair)); ++i)
    for (std::uint32_t k = 0; k < part_count(shape_of_b(pair)); ++k) {
      const FlyingSolids solids(pair, PartPair{i, k});
      const Solid &pa = solids.a().solid, &pb = solids.b().solid;
      const Separation apart = separation_between(pa, pb, first_guess(pa, pb));
      if (apart.distance_m < nearest.distance_m || (i == 0 && k == 0)) nearest = apart;
    }
  return nearest;
}

std::optional<Impact> time_of_impact(const PairStep& pair) {
  if (is_of_compounds(pair)) return impact_of_parts(pair);
  if (is_mesh(pair.scene, pair.b)) return time_of_mesh_impact(pair, 0);
  const double apart = spheres_apart_s(pair);
  if (apart > 0.0 && apart >= pair.dt_s) return std::nullopt;
  FlyingSolids solids(pair);
  const std::optional<Touch> touch = touch_of(pair, apart, solids);
  return touch ? std::optional(touch->impact) : std::nullopt;
}

namespace {

void append_distance_of_parts(const PairStep& pair, double apart, PartPair parts,
                              std::vector<ContactManifold>& out) {
  FlyingSolids solids(pair, parts);
  const std::optional<Touch> touch = touch_of(pair, apart, solids);
  if (!touch || touch->impact.time_s == 0.0) return;
  const FlyingSolids start(pair, parts);
  const Vec3& normal = touch->normal;
  ContactCandidates candidates;
  // They are apart now, but solids that turn may not be along the normal with which they will meet.
  const Solid &a = start.a().solid, &b = start.b().solid;
  double gap = gap_along(a.placed, b.placed, normal);
  if (!(gap > 0.0)) gap = std::max(0.0, separation_between(a, b, normal).distance_m);
  candidates.add(support_point(solids.a().solid.placed, normal), gap, kDistanceToImpact);
  const std::size_t before = out.size();
  emit_manifold(pair, 0, normal, solids.centre_of_a_m(), candidates, out);
  if (is_of_compounds(pair))
    number_parts(shape_of_b(pair), parts, before, out);
  else if (!touch->impact.lasts)
    out.back().impact_s = touch->impact.time_s;
}

void append_distances_of_compounds(const PairStep& pair, double apart,
                                   std::vector<ContactManifold>& out) {
  const CompiledShape& shape_b = shape_of_b(pair);
  // Those that there are.
  const std::vector<ContactManifold> met = of_pair(out, pair.a, pair.b);
  for (const PartPair& parts : parts_in_reach(pair)) {
    if (shape_b.kind == ShapeKind::kMesh)
      append_distance_to_mesh(pair, parts.a, out);
    else if (!have_met_parts(met, pair.a, pair.b, parts, shape_b))
      append_distance_of_parts(pair, apart, parts, out);
  }
  const auto of_this = [&](const ContactManifold& m) { return m.a == pair.a && m.b == pair.b; };
  std::sort(std::find_if(out.begin(), out.end(), of_this), out.end(), canonical_before);
}

}  // namespace

void append_distance_to_impact(const PairStep& pair, std::vector<ContactManifold>& out) {
  const bool mesh = is_mesh(pair.scene, pair.b);
  if (mesh && !is_of_compounds(pair)) return append_distance_to_mesh(pair, 0, out);
  const double apart = mesh ? 0.0 : spheres_apart_s(pair);
  if (apart > 0.0 && apart >= pair.dt_s) return;
  if (is_of_compounds(pair))
    append_distances_of_compounds(pair, apart, out);
  else
    append_distance_of_parts(pair, apart, {}, out);
}

}  // namespace soda::physics
