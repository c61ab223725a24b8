// What a user does to a scene while it is simulated.
#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "soda/values.hpp"

namespace soda {

// A body that is not there appears, at its declared state where nothing else is given.
struct AddBody {
  std::uint32_t body = 0;
  std::optional<Vec3> position_m = {};
  std::optional<Quat> orientation = {};
  std::optional<Vec3> velocity_m_s = {}, angular_velocity_rad_s = {};
};
struct RemoveBody {
  std::uint32_t body = 0;
};
// An impulse at a point that is given in the body's frame, from its centre of mass.
struct Push {
  std::uint32_t body = 0;
  Vec3 impulse_newton_s = {};
  Vec3 point_m = {};
};
struct SetVelocity {
  std::uint32_t body = 0;
  std::optional<Vec3> velocity_m_s = {}, angular_velocity_rad_s = {};
};
struct ChangeMaterial {
  std::uint32_t body = 0;
  double friction = 0.5, restitution = 0.0;
  double rolling_friction_m = 0.0, torsional_friction_m = 0.0;
};
// Of a hinge (rad/s, N m, rad) or slider (m/s, N, m) that has a motor.
struct SetMotor {
  std::uint32_t joint = 0;
  std::optional<double> speed = {}, most_push = {}, target = {};
};
using Action = std::variant<AddBody, RemoveBody, Push, SetVelocity, ChangeMaterial, SetMotor>;

// It acts at the beginning of the step that follows `step` steps; inputs of one step act in the
// order of their ids. An input that finds its body absent (or, to add, present) has no effect.
struct Input {
  std::uint32_t id = 0;
  std::int64_t step = 0;
  Action action = {};
};

}  // namespace soda
