// What acts on a body besides contacts and joints: its field (gravity and a constant force), its
// drive, and what pushes it as it turns and moves.
#pragma once

#include <optional>

#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/need.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// exp(-c t) after a time, its integral, and the integral of that: what is left of a velocity, the
// displacement that a velocity of 1 has made, and that of an acceleration of 1. Exact to rounding
// for any c >= 0, without libm.
struct Decay {
  double left = 1.0, speed_s = 0.0, displacement_s2 = 0.0;
};
Decay decay_over(double rate_1_s, double time_s);

Need drives_needed(const SceneDescription& scene);
Need forces_needed(const SceneDescription& scene);

// Whether all that holds these bodies besides contacts is among the manifolds, and springs.
bool are_all_springs(const SceneDescription& scene, std::span<const BodyId> ids,
                     std::span<const ContactManifold> manifolds, std::span<const BodyState> states);

// Bodies on which nothing but their field, contacts and springs can act.
std::size_t loose_bodies(const SceneDescription& scene);

// The force of the body's own frame, in the world, as it will stand `ahead_s` later at the present
// angular velocity.
Vec3 own_force_newton(const BodyForces& forces, double ahead_s, const BodyState& state);

// The velocities of `body` (loaded from `state`) after `time_s` of all that acts; place and
// attitude stay. Forces of the body's frame have their direction of `ahead_s` later. Inline, so
// that a body on which its field alone acts costs a comparison.
void push_body(const SceneDescription& scene, double time_s, double ahead_s, BodyId id,
               const BodyState& state, SolverBody& body);
inline void apply_external(const SceneDescription& scene, double time_s, double ahead_s, BodyId id,
                           const BodyState& state, SolverBody& body) {
  const BodyParams& params = scene.bodies[index_of(id)];
  if (is_pushed(params))
    push_body(scene, time_s, ahead_s, id, state, body);
  else
    body.linear += field_of(scene, params) * time_s;
}

// A body as whoever looks ahead over `time_s` has to see it: with the velocities that its pushes
// will have given it by then. Damping, which only takes some, is left out.
class SeenAhead {
 public:
  SeenAhead(const SceneDescription& scene, double time_s, BodyId id, const BodyState& state)
      : state_(&state) {
    if (is_pushed(scene.bodies[index_of(id)])) push(scene, time_s, id);
  }
  SeenAhead(const SeenAhead&) = delete;
  SeenAhead& operator=(const SeenAhead&) = delete;

  const BodyState& state() const { return pushed_ ? *pushed_ : *state_; }

 private:
  void push(const SceneDescription& scene, double time_s, BodyId id);

  const BodyState* state_;
  std::optional<BodyState> pushed_;
};

// By how much drive and thruster can accelerate a body at most; by how much its torque can.
double most_push_m_s2(const SceneDescription& scene, const BodyParams& body);
double most_twist_rad_s2(const SceneDescription& scene, const BodyParams& body);

// By how much less far than `time_s` times its velocity at the end the body comes in free flight.
Vec3 flight_lag_m(const SceneDescription& scene, double time_s, BodyId id, const BodyState& state);

// Free flight of a body that is pushed. Forces, torques and damping of the velocity are exact, and
// so is the attitude under damping alone, or under a torque about an axis that a symmetry keeps;
// under any other torque, and a force of the body's frame, it is of second order in time_s.
void fly(const SceneDescription& scene, double time_s, BodyId id, BodyState& state);

// The impulse of the drive, thruster and damping over a step, the field left out, on a body that
// starts it in this state and is not held.
Vec3 push_impulse_newton_s(const SceneDescription& scene, double time_s, BodyId id,
                           const BodyState& state);

// Its sum over bodies. Measures know that of a whole step; what advances bodies in parts of a step
// counts those of the parts, less that, among the impulses of statics.
Vec3 push_impulses_newton_s(const SceneDescription& scene, double time_s,
                            std::span<const BodyId> ids, std::span<const BodyState> states);

}  // namespace soda::physics
