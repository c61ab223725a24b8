// Dependency waits: worlds whose bodies touch wait for each other instead of being rolled back in
// every step.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "models/islands/island_merge.hpp"
#include "models/messages/messages.hpp"
#include "models/messages/schedule.hpp"

namespace soda::models {

// An island that had several owners in the last step. Its owners expect that it has them again:
// each sends each other one its ghosts and the fragment of the group, empty ones too, and waits for
// theirs. Once a step is committed, all owners of a group have it alike.
struct MixedGroup {
  physics::BodyId label{};           // the smallest id of the island
  std::vector<WorldId> owners;       // ascending, this world included
  std::vector<physics::BodyId> own;  // bodies of this world, ascending; never empty

  friend bool operator==(const MixedGroup&, const MixedGroup&) = default;
};

// Who has mattered to whom in the last step. What was sent then is sent in this step, too, if only
// to say that there is nothing, and is waited for: both sides know of it. A ghost that touches
// nothing is no reason to wait.
struct Dependencies {
  std::vector<MixedGroup> groups;   // ascending by label
  std::vector<WorldId> testers;     // that sent this world contacts, all in all groups or not
  std::vector<WorldId> tested_for;  // that this world sent contacts
  // Bodies went there at the end of the step; that, or bodies came from there at its start or went
  // there at the end of the step before. Ascending.
  std::vector<WorldId> left_to, migrants;
  // Records of merge rounds >= 1: round and other world.
  std::vector<std::pair<std::uint32_t, WorldId>> sent, received;

  friend bool operator==(const Dependencies&, const Dependencies&) = default;
};

void sort_unique(std::vector<WorldId>& worlds);

// What follows from a gate for the step: worlds that are sent to or waited for. All ascending.
struct Expected {
  std::vector<WorldId> migrants;  // to and from
  std::vector<WorldId> ghosts_to, ghosts_from, fragments_to, fragments_from;
};
Expected expected_from(const Dependencies& dependencies, WorldId self);

// Worlds that have nothing to expect any more from what this world sent them before it repeated the
// step: those of groups in which one of `bodies` is, and the testers. `bodies` ascending.
std::vector<WorldId> concerned(const Dependencies& dependencies, WorldId self,
                               std::span<const physics::BodyId> bodies);

// The first merge round >= `round` with something to send or to wait for; kNoRound if none.
inline constexpr std::uint32_t kNoRound = 0xffffffffu;
std::uint32_t next_round(const Dependencies& dependencies, const Expected& expected,
                         std::uint32_t round);

// Whether the bag lacks what is waited for at this time.
bool lacks(const Dependencies& dependencies, const Expected& expected, kernel::VirtualTime now,
           std::span<const kernel::MessageView> bag);

// Appends the group of the island, if `owners` of its bodies `ids` are several. `ids` ascending.
void note_group(std::span<const physics::BodyId> ids, std::span<const WorldId> owners, WorldId self,
                std::vector<MixedGroup>& groups);

// Adds to the fragments what partners get: for each group everything that this world knows of the
// islands which its bodies in the group are in now. All owners of a group get the same. What
// another owner of the group would get besides as a fragment of its own is taken out there.
void add_group_fragments(std::span<const MixedGroup> groups, WorldId self, const KnownGraph& known,
                         std::map<WorldId, Fragment>& fragments);

struct ReceivedFragment {
  WorldId from;
  const Fragment& fragment;
};

// Takes in a fragment. What is in the part of a group has gone to all its owners:
// it is noted as exchanged with each.
void take_fragment(std::span<const physics::BodyId> own_ids, WorldId self,
                   const ReceivedFragment& received, std::span<const MixedGroup> groups,
                   IslandMerge& merge, std::vector<physics::ContactManifold>& manifolds);

}  // namespace soda::models
