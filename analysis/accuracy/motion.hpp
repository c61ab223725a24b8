// Exact motions of single bodies, as functions of time.
#pragma once

#include <functional>
#include <optional>

#include "physics/model/scene.hpp"

namespace soda::analysis {

// Where a body is and how it moves at one time; what a closed form does not say is missing.
struct Motion {
  physics::Vec3 position_m = physics::Vec3::Zero();
  physics::Vec3 linear_velocity_m_s = physics::Vec3::Zero();
  std::optional<physics::Quat> orientation;
  std::optional<physics::Vec3> angular_velocity_rad_s;
};

// Called with ascending times from 0 on.
using MotionAt = std::function<Motion(double time_s)>;

}  // namespace soda::analysis
