// How fast a body in free flight turns, and its points move by it, at most.
#pragma once

#include "physics/model/scene.hpp"
#include "physics/shapes/compiled_shape.hpp"

namespace soda::physics {

// Of a body that no moment acts on, at any time.
struct AngularVelocityBounds {
  double angular_speed_rad_s = 0.0, change_rad_s2 = 0.0;  // and how fast it changes
  // Of any point against the centre, by its distance: the acceleration.
  double pull_1_s2 = 0.0;
  // Of the body's own points against the centre: the velocity, the acceleration, and what of it
  // comes from the change of the angular velocity.
  double speed_m_s = 0.0, pull_m_s2 = 0.0, change_m_s2 = 0.0;
  // The axis of symmetry of a body that turns about it much faster than the axis itself goes round,
  // or -1.
  int fast_axis = -1;
};

// `angular_velocity_rad_s` and `rotation` (of the body into the frame of the angular velocity) as
// of one time.
AngularVelocityBounds angular_velocity_bounds(const BodyParams& params, const CompiledShape& shape,
                                              const Mat3& rotation,
                                              const Vec3& angular_velocity_rad_s);

}  // namespace soda::physics
