// Kinematic bodies of a scenario: what they may not have, and the velocities of their paths.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"
#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"

namespace soda::scenarios {

// Velocities from a step on.
struct PathLeg {
  std::int64_t step = 0;
  Vec3 linear_m_s = Vec3::Zero(), angular_rad_s = Vec3::Zero();
};

// What only bodies with a mass have, a path of others, and a body without any mass, are faults.
void check_kinematic(const BodySpec& spec, FaultList& faults);

// The legs of the path, of which the first begins at step 0 and the last is a stand; none without a
// path. `center_m` is the centre of the shape in its own frame, `start` the body's state.
std::vector<PathLeg> legs_of(const BodySpec& spec, const Vec3& center_m,
                             const physics::BodyState& start, double time_step_s,
                             FaultList& faults);

// The way to turn from one to the other, as axis times angle: the shorter one, at most pi.
Vec3 turn_between(const physics::Quat& from, const physics::Quat& to);

}  // namespace soda::scenarios
