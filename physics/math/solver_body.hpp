// What solvers change of a body.
#pragma once

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// Velocities of a body while its island is solved.
struct SolverBody {
  Vec3 linear = Vec3::Zero();
  Vec3 angular = Vec3::Zero();
  double inverse_mass = 0.0;
  Mat3 inverse_inertia = Mat3::Zero();  // world frame
};

// As the state has it, without external forces.
SolverBody solver_body(const BodyParams& params, const BodyState& state);

}  // namespace soda::physics
