// Contacts of an island in which something comes near for a hit: which points hit, and when.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "physics/model/body_places.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

struct ContactImpactIsland : IslandStep {
  explicit ContactImpactIsland(const IslandStep& step);

  template <typename State>
  State& state_of(BodyId id, std::span<State> states) const {
    return states[place_of(ids, id)];
  }
  bool bounces(const ContactManifold& m) const;
  double width_m(const ContactManifold& m) const;
  // The largest approach at a point of this pair that is no hit; infinite if none is.
  double slow_m_s(const ContactManifold& m) const;
  // How fast the surfaces come nearer at the point.
  double approach_m_s(const ContactManifold& m, const ContactPoint& p,
                      std::span<const BodyState> states) const;
  double strongest_field_m_s2() const { return strongest_field_m_s2_; }

 private:
  bool sends_;  // some body on to others (sent_on.hpp): a manifold without points connects them
  double strongest_field_m_s2_;
};

inline constexpr double kForeseenRotation_rad = 0.05;

// By how much what pushes a body besides its field can change the velocity of any of its points, in
// a second.
double pushed_m_s2(const ContactImpactIsland& island, BodyId id, const BodyState& state);

// For how long nothing is hit: 0 if something is now. Two bodies are apart as long as there is a
// gap along any direction: that along the normal closes at the speed of the centres, and as fast as
// rotations can move points that are not known yet. Where it is small, its own points close it.
double clear_s(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
               std::span<const BodyState> states);

// For how long the points that are nearest tell of what comes near: until something has turned by a
// twentieth of a radian, which shows other features. What spins may come round and hit again.
double foreseen_s(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
                  std::span<const BodyState> states);

// The contact without points that come nearer for a hit.
ContactManifold without_impacts(const ContactImpactIsland& island, const ContactManifold& contact,
                                std::span<const BodyState> states);

// Appends contacts without these: until a hit its points have no part in it. Solvers would slow
// them down before, as soon as they are within reach of one more of their steps; and what they
// pressed with in the step before would have them held at the distance that they are at
// (try_steps), so that is forgotten.
void append_held(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
                 std::span<BodyState> states, std::vector<ContactManifold>& held);

// Appends what is hit now, and what is held meanwhile: points that touch, with no gap left. Returns
// whether there are any.
bool append_touching(const ContactImpactIsland& island, std::span<const ContactManifold> contacts,
                     std::span<const BodyState> states, std::vector<ContactManifold>& touching);

}  // namespace soda::physics
