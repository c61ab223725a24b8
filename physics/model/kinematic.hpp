// Kinematic bodies: what gravity does to pairs with them, and which islands have them.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/need.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

Need kinematic_needed(const SceneDescription& scene);

inline bool is_kinematic(const SceneDescription& scene, BodyId id) {
  return !is_static(id) && scene.bodies[index_of(id)].kinematic;
}

inline bool any_kinematic(const SceneDescription& scene, std::span<const BodyId> ids) {
  for (const BodyId id : ids)
    if (is_kinematic(scene, id)) return true;
  return false;
}

// Whether a kinematic body among them has a velocity.
bool any_carries(const SceneDescription& scene, std::span<const BodyId> ids,
                 std::span<const BodyState> states);

// What gravity accelerates: bodies, but no statics and nothing that is kinematic.
inline bool falls(const SceneDescription& scene, BodyId id) {
  return !is_static(id) && !is_kinematic(scene, id);
}

// Of b against a. Nothing where both fall.
inline Vec3 relative_gravity(const SceneDescription& scene, BodyId a, BodyId b) {
  const bool of_a = falls(scene, a), of_b = falls(scene, b);
  if (of_a == of_b) return Vec3::Zero();
  return of_b ? scene.gravity_m_s2 : Vec3(-scene.gravity_m_s2);
}

}  // namespace soda::physics
