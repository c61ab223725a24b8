#include "physics/continuous/time_of_impact.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {
namespace {

void collide_shapes(const SceneDescription& scene, const Geometry& geometry, double dt_s, BodyId a,
                    const BodyState& state_a, BodyId b, const BodyState* state_b,
                    std::vector<ContactManifold>& out, StageCounters& counters) {
  const std::size_t before = out.size();
  if (append_manifolds(scene, geometry, dt_s, a, state_a, b, state_b, out, counters))
    append_way_to_impact(scene, geometry, dt_s, a, state_a, b, state_b, out);
  counters.manifolds += out.size() - before;
  for (std::size_t m = before; m < out.size(); ++m) counters.contact_points += out[m].count;
}

}  // namespace

void collide(const SceneDescription& scene, const Geometry& geometry, double dt_s, BodyId a,
             const BodyState& state_a, BodyId b, const BodyState* state_b,
             std::vector<ContactManifold>& out, StageCounters& counters) {
  if (may_touch(scene, a, state_a, b))
    collide_shapes(scene, geometry, dt_s, a, state_a, b, state_b, out, counters);
  if (!scene.joints.empty() && !is_static(b)) append_joints(scene, a, state_a, b, out);
}

}  // namespace soda::physics
