// Rigid placement of a shape.
#pragma once

#include "physics/model/ids.hpp"

namespace soda::physics {

struct Pose {
  Mat3 rotation = Mat3::Identity();
  Vec3 position = Vec3::Zero();

  Vec3 to_world(const Vec3& local) const { return rotation * local + position; }
  Vec3 to_local(const Vec3& world) const { return rotation.transpose() * (world - position); }
  Vec3 direction_to_local(const Vec3& world) const { return rotation.transpose() * world; }
};

inline bool is_finite(const Vec3& v) { return v.allFinite(); }

}  // namespace soda::physics
