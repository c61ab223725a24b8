#include "physics/broadphase/swept_pair_query.hpp"

#include <algorithm>

#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

SweptPairs query_swept_pairs(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids, std::span<const BodyState> states,
                             StageCounters& counters) {
  double fastest = 0.0;
  for (const BodyState& s : states) fastest = std::max(fastest, s.linear_velocity_m_s.norm());
  const double reach_m = (2.0 * fastest + strongest_field_m_s2(scene, ids) * dt_s) * dt_s;
  std::vector<Aabb> boxes;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    BodyState still = states[i];
    still.linear_velocity_m_s = Vec3::Zero();
    still.angular_velocity_rad_s = still.angular_velocity_rad_s * 2.0;
    Aabb box = swept_aabb(scene, geometry, ids[i], still);
    box.min -= Vec3::Constant(reach_m);
    box.max += Vec3::Constant(reach_m);
    boxes.push_back(box);
  }
  SweptPairs pairs;
  find_pairs(scene.broadphase, boxes, pairs.bodies, counters);
  find_static_pairs(geometry, boxes, pairs.statics, counters);
  std::erase_if(pairs.bodies, [&](const IndexPair& p) {
    return !groups_touch(scene, ids[p.first], ids[p.second]);
  });
  std::erase_if(pairs.statics, [&](const IndexPair& p) {
    return !groups_touch(scene, ids[p.first], static_id(p.second));
  });
  return pairs;
}

std::vector<ContactManifold> pairs_to_look_at(const SceneDescription& scene,
                                              const Geometry& geometry, double dt_s,
                                              std::span<const BodyId> ids,
                                              std::span<const BodyState> states,
                                              StageCounters& counters) {
  const SweptPairs found = query_swept_pairs(scene, geometry, dt_s, ids, states, counters);
  std::vector<ContactManifold> pairs;
  const auto add = [&pairs](BodyId a, BodyId b) {
    ContactManifold& m = pairs.emplace_back();
    m.a = a;
    m.b = b;
  };
  for (const IndexPair& p : found.bodies) add(ids[p.first], ids[p.second]);
  for (const IndexPair& p : found.statics) add(ids[p.first], static_id(p.second));
  std::sort(pairs.begin(), pairs.end(), canonical_before);
  return pairs;
}

}  // namespace soda::physics
