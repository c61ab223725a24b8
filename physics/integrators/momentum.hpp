// Momentum of an island that nothing outside acts on but gravity.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// About the centre of mass, world frame.
struct IslandMomentum {
  double mass_kg = 0.0;
  Vec3 centre_m = Vec3::Zero();
  Vec3 linear_newton_s = Vec3::Zero();
  Vec3 angular_newton_m_s = Vec3::Zero();
  Mat3 inertia_kg_m2 = Mat3::Zero();
  double kinetic_joule = 0.0;  // as seen from the centre of mass
  // The field of the first body, and what the fields of others do besides: the sum of the forces,
  // and their torque about the centre of mass.
  Vec3 field_m_s2 = Vec3::Zero();
  Vec3 other_newton = Vec3::Zero(), other_newton_m = Vec3::Zero();
  bool one_field = true;
};
IslandMomentum momentum_of(const SceneDescription& scene, std::span<const BodyId> ids,
                           std::span<const BodyState> states);

// Whether only fields act on the island from outside: no static, drive or thruster; and no joint is
// in it. Several bodies: one alone flies.
bool is_isolated_system(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds,
                        std::span<const BodyState> states);

// Gives an island that was isolated for dt_s since `before` the centre of mass and the momenta
// that it must have, to rounding (under own forces, of the second order in dt_s): it is shifted,
// and a rigid motion of the whole is added, the one of least energy. Relative velocities within it
// keep their directions, and shrink if energy would rise. Then a position correction has given no
// energy.
void keep_momentum(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                   const IslandMomentum& before, std::span<BodyState> states);

}  // namespace soda::physics
