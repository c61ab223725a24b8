// Where a joint holds on.
#pragma once

#include <cstdint>
#include <span>

#include "physics/model/body_state.hpp"

namespace soda::physics {

// An anchor of a body, or of the world: m, world axes.
struct JointAnchor {
  Vec3 arm = Vec3::Zero(), place_m = Vec3::Zero();  // arm: from the body's centre
};

// `anchor_m` is fixed in the body, which is the world's if it is none of the states.
inline JointAnchor anchor_of(std::span<const BodyState> states, std::uint32_t body,
                             const Vec3& anchor_m) {
  if (body >= states.size()) return {Vec3::Zero(), anchor_m};
  const Vec3 arm = states[body].orientation * anchor_m;
  return {arm, states[body].position_m + arm};
}

}  // namespace soda::physics
