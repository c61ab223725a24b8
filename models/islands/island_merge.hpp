// Merging islands that span several worlds: what a world knows of them within one step, and what
// it still has to send.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "models/messages/messages.hpp"
#include "physics/broadphase/islands.hpp"

namespace soda::models {

// A record is a body (a == b) or the contact of a pair (a < b; b may be static).
using RecordKey = std::pair<physics::BodyId, physics::BodyId>;

// The canonical order of manifolds: by (a, b, part).
using physics::canonical_before;

// Records without what they say, ascending.
class RecordSet {
 public:
  // In any order; known and repeated ones are no more than once in it.
  void insert(std::vector<RecordKey> keys);

  auto begin() const { return keys_.begin(); }
  auto end() const { return keys_.end(); }

 private:
  std::vector<RecordKey> keys_;
};

// A world's knowledge beyond its own bodies, for one step. Starts empty in every step.
struct IslandMerge {
  std::vector<Node> nodes;  // foreign bodies known, ascending by id
  // Per foreign world: the records that it has had from this world or sent to it in this step.
  std::map<WorldId, RecordSet> exchanged;
};

// Own bodies and foreign nodes as one ascending list.
struct KnownBodies {
  std::vector<physics::BodyId> ids;
  std::vector<WorldId> owners;
  // Where the state is: own body index, or -1 - node index.
  std::vector<std::int32_t> place;
};

// The bodies that a world knows, with their states, and the contacts between them.
struct KnownGraph {
  const KnownBodies& bodies;
  std::span<const physics::BodyState> own_states;
  std::span<const Node> nodes;                            // foreign ones
  std::span<const physics::ContactManifold> manifolds{};  // in canonical order

  Node node(std::uint32_t body) const {
    const std::int32_t place = bodies.place[body];
    return {bodies.ids[body], bodies.owners[body],
            place >= 0 ? own_states[static_cast<std::size_t>(place)]
                       : nodes[static_cast<std::size_t>(-1 - place)].state};
  }
};

// Takes in records from world `from`: unknown nodes and unknown pairs are added (`manifolds` stays
// in canonical order), known ones are left as they are, and all are noted as exchanged with `from`.
// Contacts with a body that is neither own nor known are dropped: only speculation has them.
void add_records(std::span<const physics::BodyId> own_ids, WorldId from, const Records& records,
                 IslandMerge& merge, std::vector<physics::ContactManifold>& manifolds);

// The same for a fragment. Its sender tested the pairs, told both owners, and where it owns neither
// body it has forgotten them since. So a contact is noted as exchanged with the owner of the other
// body, and the own body, too; but nothing with a sender who is a third world. Noting more would
// withhold from that what its own island may need.
void add_fragment(std::span<const physics::BodyId> own_ids, WorldId from, const Records& records,
                  IslandMerge& merge, std::vector<physics::ContactManifold>& manifolds);

// Notes the records as exchanged with the world.
void note_exchanged(const Records& records, WorldId with, IslandMerge& merge);

// Adds a node if its id is neither own nor known.
void add_node(std::span<const physics::BodyId> own_ids, const Node& node, IslandMerge& merge);

KnownBodies known_bodies(std::span<const physics::BodyId> own_ids, WorldId self,
                         const IslandMerge& merge);

// What merge round `round` has to send: for each island with an own body (from round 1 on only if
// it has more than `round` owners), every foreign owner in contact with an own body gets each
// record of the island that it does not own and that has not been exchanged with it. What is
// returned is noted as exchanged.
//
// The owners bound makes rounds end: news travels one owner a round, and no chain of owners is
// longer than their number. Without it a withdrawn record chases its anti-message round a cycle.
std::map<WorldId, Records> outgoing_records(std::uint32_t round, WorldId self,
                                            const KnownBodies& known,
                                            std::span<const physics::BodyState> own_states,
                                            std::span<const physics::ContactManifold> manifolds,
                                            IslandMerge& merge);

}  // namespace soda::models
