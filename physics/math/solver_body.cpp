#include "physics/math/solver_body.hpp"

#include "physics/math/rigid_motion.hpp"

namespace soda::physics {

SolverBody solver_body(const BodyParams& params, const BodyState& state) {
  return {.linear = state.linear_velocity_m_s,
          .angular = state.angular_velocity_rad_s,
          .inverse_mass = params.kinematic ? 0.0 : 1.0 / params.mass_kg,
          .inverse_inertia = is_isotropic(params.inertia_local_kg_m2)
                                 ? params.inverse_inertia_local
                                 : rotated_tensor(state.orientation.toRotationMatrix(),
                                                  params.inverse_inertia_local)};
}

}  // namespace soda::physics
