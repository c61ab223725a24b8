// The step that a world executes: what its phases hand on to one another.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "models/cost/work_cost.hpp"
#include "models/islands/island_merge.hpp"
#include "models/messages/messages.hpp"
#include "models/transform_buffer/repetition.hpp"
#include "models/user_input/rules.hpp"
#include "models/world/surroundings.hpp"
#include "physics/step/step.hpp"

namespace soda::models {

using Bag = std::span<const kernel::MessageView>;

// All of it, but for the first three, is rebuilt from a buffer entry when the step restarts.
struct StepInProgress {
  const WorldSurroundings around;
  const WorldId self;
  WorkReading work{};  // of all steps so far

  Rules rules;
  std::vector<physics::BodyId> ids{};  // own bodies, ascending
  std::vector<physics::BodyState> states{};
  std::vector<Ghost> ghosts{};  // ascending by id, none of them own
  IslandMerge merge{};
  Repetition repetition{};
  bool remembers = false;    // leaves a memo: a repetition of the step may take from it
  StepMemo memo{};           // only if it remembers
  std::uint32_t solves = 0;  // islands with an own body
  physics::StepScratch scratch{};
  physics::StepReport report{};

  bool divided() const { return rules.map->worlds() > 1; }
  // Whether re-executed steps take over what has not changed.
  bool propagates() const { return around.rollback != RollbackMode::kInvalidate; }
  KnownBodies known_bodies() const { return models::known_bodies(ids, self, merge); }

  // As `rules` say, with nothing but the rules known.
  void start(const Rules& rules_of_step);
  // Of own bodies, whatever passes have made of them since.
  std::vector<physics::BodyState> states_at_start() const;
  // Counts an island of so many bodies that a repetition has taken over, or has not.
  void count_repetition(bool taken, std::size_t bodies);
};

}  // namespace soda::models
