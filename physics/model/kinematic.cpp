#include "physics/model/kinematic.hpp"

#include <algorithm>

namespace soda::physics {

Need kinematic_needed(const SceneDescription& scene) {
  return need_of(bodies_that(scene, [](const BodyParams& body) { return body.kinematic; }) > 0,
                 "a body is kinematic", "no body is kinematic");
}

bool any_carries(const SceneDescription& scene, std::span<const BodyId> ids,
                 std::span<const BodyState> states) {
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (is_kinematic(scene, ids[i]) && (states[i].linear_velocity_m_s != Vec3::Zero() ||
                                        states[i].angular_velocity_rad_s != Vec3::Zero()))
      return true;
  return false;
}

double strongest_field_m_s2(const SceneDescription& scene, std::span<const BodyId> ids) {
  double strongest = scene.gravity_m_s2.norm();
  for (const BodyId id : ids) strongest = std::max(strongest, field_of(scene, id).norm());
  return strongest;
}

}  // namespace soda::physics
