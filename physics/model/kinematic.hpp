// Kinematic bodies: how pairs with them are accelerated, and which islands have them.
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

// What forces accelerate: bodies, but no statics and nothing that is kinematic.
inline bool falls(const SceneDescription& scene, BodyId id) {
  return !is_static(id) && !is_kinematic(scene, id);
}

// By gravity and a constant force; of what does not fall, none.
inline Vec3 field_of(const SceneDescription& scene, BodyId id) {
  return falls(scene, id) ? field_of(scene, scene.bodies[index_of(id)]) : Vec3(Vec3::Zero());
}

// Of b against a. Gravity alone accelerates no two that fall against each other.
inline Vec3 relative_field(const SceneDescription& scene, BodyId a, BodyId b) {
  return field_of(scene, b) - field_of(scene, a);
}

// The strongest that acts on one of them, gravity at least.
double strongest_field_m_s2(const SceneDescription& scene, std::span<const BodyId> ids);

}  // namespace soda::physics
