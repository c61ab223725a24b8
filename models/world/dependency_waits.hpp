// Dependency waits of a world in one step: whom it waits for, and who waits for it.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "models/islands/dependencies.hpp"
#include "models/messages/messages.hpp"

namespace soda::models {

// Both sides of a wait know of it from the step before (dependencies.hpp). What is noted of this
// step makes the waits of the next one. If dependency waits are off nothing is kept, so nobody
// waits.
class DependencyWaits {
 public:
  DependencyWaits(bool are_on, WorldId self) : on_(are_on), self_(self) {}

  // `before`: what the step before has left.
  void start(const Dependencies& before);

  // Of this step, because of the one before.
  const std::vector<MixedGroup>& groups() const { return before_.groups; }
  const Expected& expected() const { return expected_; }
  // Sends in merge round `round`, if only an empty message.
  std::vector<WorldId> partners_in(std::uint32_t round) const;
  std::uint32_t next_round(std::uint32_t round) const {
    return models::next_round(before_, expected_, round);
  }
  // Whether the bag lacks what is waited for at this time.
  bool lacks(kernel::VirtualTime now, std::span<const kernel::MessageView> bag) const {
    return models::lacks(before_, expected_, now, bag);
  }

  // What happens in this step.
  void note_migrants_from(std::span<const WorldId> sources);
  // Adds who waits for migrants; `leaving` has an entry for each world that gets some.
  void note_migrants_to(std::map<WorldId, std::vector<Migrant>>& leaving);
  void note_tested_for(WorldId other);
  void note_tester(WorldId other);
  void note_records_to(std::uint32_t round, WorldId other);
  void note_records_from(std::uint32_t round, WorldId other);
  // An island; `owners` of its bodies `ids`.
  void note_island(std::span<const physics::BodyId> ids, std::span<const WorldId> owners);

  bool are_on() const { return on_; }
  // Worlds that have nothing to expect any more from what this one sent them before it repeated the
  // step, in which `bodies` came out differently.
  std::vector<WorldId> concerned(std::span<const physics::BodyId> bodies) const {
    return models::concerned(next_, self_, bodies);
  }
  // What this step leaves, as far as it goes. For the buffer entry, which may take it.
  Dependencies& next() { return next_; }

 private:
  const bool on_;
  const WorldId self_;
  Dependencies before_;
  Expected expected_;  // from it
  Dependencies next_;
};

}  // namespace soda::models
