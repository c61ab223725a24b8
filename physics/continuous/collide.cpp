#include <algorithm>
#include <optional>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/forces/forces.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

void collide_shapes(const PairStep& pair, std::vector<ContactManifold>& out,
                    StageCounters& counters) {
  const std::size_t before = out.size();
  if (append_manifolds(pair, out, counters)) append_distance_to_impact(pair, out);
  counters.manifolds += out.size() - before;
  for (std::size_t m = before; m < out.size(); ++m) counters.contact_points += out[m].count;
}

// How far one of a pair can come along the normal towards another that stands still.
double displacement_towards_m(const SceneDescription& scene, const Geometry& geometry, BodyId id,
                              const BodyState& state, const Vec3& normal) {
  const double rotation = std::min(state.angular_velocity_rad_s.norm() * scene.dt_s, 2.0);
  const Vec3 displacement =
      (state.linear_velocity_m_s + field_of(scene, scene.bodies[index_of(id)]) * scene.dt_s) *
      scene.dt_s;
  return std::max(0.0, displacement.dot(normal)) +
         rotation * shape_of(scene, geometry, id).bounding_radius_m;
}

// Joints can stop either of the pair within the step, and then the other comes up to it: a manifold
// without points, so that they are of one island, which looks at their paths (linked_step.hpp).
// What joints connect is of one island anyway.
void append_if_one_stops(const PairStep& pair, std::vector<ContactManifold>& out,
                         StageCounters& counters) {
  const auto& [scene, geometry, dt_s, a, state_a, b, state_b] = pair;
  const std::vector<std::uint32_t>& articulations = geometry.impl().articulations;
  if (articulations[index_of(a)] == articulations[index_of(b)] || !may_touch(scene, a, state_a, b))
    return;
  if (!overlap(swept_solid(scene, geometry, a, state_a), swept_solid(scene, geometry, b, *state_b)))
    return;
  const Separation apart = separation_of(pair);
  ++counters.linked_searches;
  const double width = std::min(shape_of_a(pair).min_extent_m, shape_of_b(pair).min_extent_m);
  if (apart.distance_m > kContactMargin * width +
                             displacement_towards_m(scene, geometry, a, state_a, apart.normal) +
                             displacement_towards_m(scene, geometry, b, *state_b, -apart.normal))
    return;
  ContactManifold& reached = out.emplace_back();
  reached.a = a;
  reached.b = b;
}

}  // namespace

void collide(const PairStep& now, std::vector<ContactManifold>& out, StageCounters& counters) {
  const SceneDescription& scene = now.scene;
  const SeenAhead a(scene, now.dt_s, now.a, now.state_a);
  std::optional<SeenAhead> b;
  if (now.state_b != nullptr) b.emplace(scene, now.dt_s, now.b, *now.state_b);
  const PairStep pair{
      scene, now.geometry, now.dt_s, now.a, a.state(), now.b, b ? &b->state() : nullptr};
  const std::size_t before = out.size();
  if (may_touch(scene, pair.a, pair.state_a, pair.b)) collide_shapes(pair, out, counters);
  if (scene.joints.empty() || is_static(pair.b)) return;
  if (out.size() == before && scene.solver.contact_response)
    append_if_one_stops(pair, out, counters);
  append_joints(scene, pair.a, pair.state_a, pair.b, out);
}

}  // namespace soda::physics
