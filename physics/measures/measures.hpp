// Measures of committed states: energy, momentum, digest.
#pragma once

#include <cstdint>
#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

struct Mechanics {
  double kinetic_energy_joule = 0.0;
  // In uniform gravity and under constant forces, zero at the world origin; of springs.
  double potential_energy_joule = 0.0;
  Vec3 linear_momentum_newton_s = Vec3::Zero();
  Vec3 angular_momentum_newton_m_s = Vec3::Zero();  // about the world origin
  double momentum_scale_newton_s = 0.0;             // sum of m |v|
};

// ids ascending; sums run in that order.
Mechanics measure(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<const BodyState> states);

// Impulse that drives, forces and damping give to bodies in these states over the coming step, and
// the sum of its
// parts' magnitudes. An external impulse, like gravity's.
struct DriveImpulse {
  Vec3 sum_newton_s = Vec3::Zero();
  double scale_newton_s = 0.0;
};
DriveImpulse drive_impulse(const SceneDescription& scene, std::span<const BodyId> ids,
                           std::span<const BodyState> states);

// XXH3-64 over the named fields of the states in ascending id order, little-endian.
std::uint64_t digest(std::span<const BodyId> ids, std::span<const BodyState> states);

}  // namespace soda::physics
