// Impulses of joints from step to step, beside those of contacts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"

namespace soda::physics {

// They are kept in the state of the lower body: entries with the joint's part. Features 0 and 1
// have what rows along and about lines give to b, and as normal impulses those of both limits; 2
// has that of the motor.
void load_joint_impulses(const SceneDescription& scene, std::span<const BodyState> states,
                         JointSystem& system);
void append_joint_impulses(const SceneDescription& scene, std::uint32_t joint_place,
                           const JointSystem& system, std::vector<ContactImpulse>& out);

}  // namespace soda::physics
