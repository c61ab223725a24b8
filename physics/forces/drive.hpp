// Driven bodies: what pushes them besides gravity and contacts.
#pragma once

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// The velocity that the drive wants of a body at this place.
Vec3 wanted_velocity(const Drive& drive, const Vec3& gravity_m_s2, const Vec3& position_m);

// Acceleration by the drive over the coming step, orthogonal to gravity (any direction without
// gravity). A function of the body's own state: (wanted - v) / (time constant + dt), which is the
// drive's law at the step's end, so that no step is too long for it.
Vec3 drive_acceleration(const SceneDescription& scene, double dt_s, const Drive& drive,
                        const BodyState& state);

// The body's field, and its drive if it has one. Inline, so that a body without a drive costs a
// comparison.
inline Vec3 external_acceleration(const SceneDescription& scene, double dt_s, BodyId id,
                                  const BodyState& state) {
  const BodyParams& body = scene.bodies[index_of(id)];
  if (body.drive == kNoDrive) return field_of(scene, body);
  return field_of(scene, body) + drive_acceleration(scene, dt_s, scene.drives[body.drive], state);
}

}  // namespace soda::physics
