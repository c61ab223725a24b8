// What the bodies of an island with joints come to within a step, beside what they were seen to be
// on their way to.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "physics/events/linked_impacts.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {

// Parts of its step have faults of their own.
struct LinkedIsland : IslandStep {
  SolveScratch& scratch;
  StageCounters& counters;
  bool wedged = false;  // something overlaps by a good part of its width: little does not count
  bool in_substeps = false;  // it is swept, a substep a part
  double longest_s = dt_s;   // of a part that does not sink in, as far as is known

  const CompiledShape& shape_of(std::size_t body) const {
    return geometry.impl().shapes[scene.bodies[index_of(ids[body])].shape].shape;
  }
  std::size_t place_of(BodyId id) const { return physics::place_of(ids, id); }
};

// Of a body's width: how far it may sink within a part, and how far it may not be seen to.
inline constexpr double kTooDeep = 0.5, kVisible = 0.001;

bool is_wedged(const LinkedIsland& island);

// When the first pair without manifold touches, in the motions that the bodies made in `time_s`.
// `motions` are flights from where a part began to where it ended; `before` is where it began.
std::optional<double> first_unseen_s(const LinkedIsland& island, double time_s,
                                     std::span<const ContactManifold> manifolds,
                                     std::span<const BodyState> before,
                                     std::span<const BodyState> motions);

// The first of them to touch, if before `first_s`. One that does so at once, and does not come near
// fast enough to bounce, is noted as held: it is a row from now on.
std::optional<double> first_bounce_s(const LinkedIsland& island, double time_s,
                                     const BouncesInTime& located, std::optional<double> first_s,
                                     std::span<const BodyState> motions,
                                     std::vector<Touching>& held);

// Contacts where the bodies are now: along their own velocities, and where that finds none in the
// motions that the joints gave them, if there are any. Joints are those of `before`. In canonical
// order.
std::vector<ContactManifold> contacts_now(const LinkedIsland& island, double time_s,
                                          std::span<const ContactManifold> before,
                                          std::span<const BodyState> states,
                                          std::span<const BodyState> motions);

// By how much a pair came to overlap, of the smaller body's width; overlaps there were do not
// count. Pairs that did not come far enough for what is looked for are left out, and those of
// bodies that have no manifold: these are looked for on the way.
double relative_depth(const LinkedIsland& island, std::span<const ContactManifold> manifolds,
                      std::span<const BodyState> before, std::span<const BodyState> after,
                      std::span<const BodyState> motions, double time_s);

}  // namespace soda::physics
