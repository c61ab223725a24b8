// Contacts in a world that holds ghosts: who tests which pair, and who has to receive it.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "models/messages/messages.hpp"
#include "models/territory/territory.hpp"
#include "models/transform_buffer/repetition.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/step/sleeping_islands.hpp"

namespace soda::models {

// Where contacts of bodies may be known that are as they were: in the execution that is replaced,
// and in the step before.
struct KnownContacts {
  const Repetition& repetition;
  const physics::SleepingIslands& resting;
};

// The bodies in a world at the start of a step: its own, ascending, with the boxes that they are in
// during the step, and the ghosts of others, ascending by id.
struct PresentBodies {
  WorldId self;
  std::span<const physics::BodyId> ids;
  std::span<const physics::BodyState> states;
  std::span<const physics::Aabb> boxes;
  std::span<const Ghost> ghosts;
};

struct BorderContacts {
  // All contacts of own bodies that this world tests, in canonical order.
  std::vector<physics::ContactManifold> manifolds;
  std::vector<Node> foreign;  // foreign bodies in these contacts, ascending, unique
  // Cross-owner contacts by the foreign owner who must receive them; two ghosts can be such a pair.
  std::map<WorldId, Fragment> fragments;
  // Contacts between ghosts that this world has tested for their owners; ascending pairs.
  std::vector<physics::ContactManifold> for_others;
  std::size_t pairs_of_others = 0;  // whose boxes meet, and that another world tests
};

// Pairs with one owner are tested by that owner; others by the world that owns the cell with the
// min corner of the intersection of the two swept boxes. That point lies in both boxes, so this
// world has both bodies and no other world tests them: every pair is tested exactly once.
// No ghost is own. What is `known` is not tested again.
BorderContacts find_border_contacts(const physics::SceneDescription& scene,
                                    const physics::Geometry& geometry, const TerritoryMap& map,
                                    const PresentBodies& present, const KnownContacts& known,
                                    physics::StageCounters& counters);

}  // namespace soda::models
