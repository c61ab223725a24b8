// Vectors and states. SI units, world frame, double precision.
#pragma once

#include <cstdint>

namespace soda {

struct Vec3 {
  double x = 0.0, y = 0.0, z = 0.0;
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

// A unit quaternion: turns from a body's frame into the world's.
struct Quat {
  double w = 1.0, x = 0.0, y = 0.0, z = 0.0;
  friend bool operator==(const Quat&, const Quat&) = default;
};

// Of a body. Its position is that of its centre of mass.
struct BodyState {
  Vec3 position_m = {};
  Quat orientation = {};
  Vec3 velocity_m_s = {};
  Vec3 angular_velocity_rad_s = {};
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

// What something is part of: a body, by its id, or a static, by its place among the scene's.
struct Solid {
  bool is_static = false;
  std::uint32_t id = 0;
  friend bool operator==(const Solid&, const Solid&) = default;
};

}  // namespace soda
