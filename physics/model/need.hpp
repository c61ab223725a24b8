// What a scene can need of a stage of the step, whatever happens in a run. Each stage says so
// beside the code that decides about it (`..._needed`), by the condition that the code itself
// checks: what is not needed cannot be entered, by no step and by no speculation.
#pragma once

#include <algorithm>
#include <cstddef>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

struct Need {
  bool is_needed = false;
  const char* reason = "";  // one clause, e.g. "no joint has a motor"

  explicit operator bool() const { return is_needed; }
};

inline Need need_of(bool is_needed, const char* why, const char* why_not) {
  return {is_needed, is_needed ? why : why_not};
}

// Those of which a condition on their parameters holds.
template <class Condition>
std::size_t bodies_that(const SceneDescription& scene, Condition condition) {
  return static_cast<std::size_t>(std::ranges::count_if(scene.bodies, condition));
}
template <class Condition>
std::size_t statics_that(const SceneDescription& scene, Condition condition) {
  return static_cast<std::size_t>(std::ranges::count_if(scene.statics, condition));
}

// Two bodies, or one and a static.
inline bool can_meet(std::size_t bodies, std::size_t statics) {
  return bodies > 1 || (bodies == 1 && statics > 0);
}

// As long as its joints are not broken; and whether all of them can break.
inline bool is_unjointed(const BodyParams& body, const BodyState& state) {
  return body.joints == state.broken_joints.size();
}
inline bool can_be_unjointed(const BodyParams& body) { return body.lasting_joints == 0; }

// Statics that are no meshes.
std::size_t solid_statics(const SceneDescription& scene);

// Whether two bodies may touch (joint.hpp), or one and a static, and contacts have a response.
Need contacts_needed(const SceneDescription& scene);

}  // namespace soda::physics
