// Rollback and Propagate: what a re-executed step can take over from the execution that it
// replaces.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "models/transform_buffer/stored_entry.hpp"

namespace soda::models {

// One step that is executed, perhaps again. A body is *unchanged* if it begins the step in the
// state that it had in the replaced execution, bit for bit. What the step computes of unchanged
// bodies alone (a contact, an island) comes out as it did, because all of it is pure functions of
// states.
//
// start(), note_own(), note_touched(), note_constants(), note_ghosts(), then contacts, then
// islands, then differences(). `replaced` must stay as it is from start() to differences().
class Repetition {
 public:
  // `replaced`: the stale entry that the step wrote before; null if it is executed for the first
  // time. `changed`: own bodies whose state differs from the one `replaced` was computed from.
  // `map`: of the step, now; must outlive it.
  void start(std::span<const physics::BodyId> changed, const StoredEntry* replaced,
             const TerritoryMap& map);

  // Whether there is an execution to compare with; and whether it can be taken from.
  bool repeats() const { return replaced_ != nullptr; }
  bool can_take() const { return repeats() && replaced_->memo_valid && same_constants_; }
  bool unchanged(physics::BodyId id) const;

  // `migrants`: of the own bodies, those that have just come.
  void note_own(std::span<const physics::BodyId> ids, std::span<const Migrant> migrants);
  // `touched`: by user input, now. What was touched in the replaced execution is known.
  void note_touched(std::span<const physics::BodyId> touched);
  // Whether shapes and materials are those of the replaced execution: else nothing can be taken.
  void note_constants(bool same) { same_constants_ = same; }
  void note_ghosts(std::span<const Ghost> ghosts);

  // Appends the contacts of the pair if both are unchanged; else false, and it has to be tested.
  // `b` may be static.
  bool take_contacts(physics::BodyId a, physics::BodyId b,
                     std::vector<physics::ContactManifold>& manifolds) const;

  // Fills in the states that the island ended with, if it is the same island of unchanged bodies,
  // all of them own; `report` is set if it has contacts. `ids` ascending, `states[i]` of ids[i].
  bool take_island(std::span<const physics::BodyId> ids, std::span<physics::BodyState> states,
                   physics::IslandReport* report);

  // Puts the contact impulses that the replaced step ended with in place of those that it began
  // with. False if it had none of these bodies. Breaks the independence of history: only for kWarm.
  bool take_impulses(std::span<const physics::BodyId> ids,
                     std::span<physics::BodyState> states) const;

  // Own bodies whose state at the end is not the one that the replaced step ended with, and those
  // that the entry after it differed in already. Ascending.
  std::vector<physics::BodyId> differences(std::span<const physics::BodyId> ids,
                                           std::span<const physics::BodyState> states) const;

 private:
  const StoredEntry* replaced_ = nullptr;
  bool same_map_ = false;  // as in the replaced execution
  bool same_constants_ = true;
  std::vector<physics::BodyId> changed_;
  std::vector<physics::BodyId> unchanged_;  // ascending; own bodies and ghosts
};

}  // namespace soda::models
