// Advancing the bodies of a world by a step: its islands as far as it knows them, and what is in
// none.
#pragma once

#include <cstdint>
#include <span>

#include "models/world/dependency_waits.hpp"
#include "models/world/ghost_extrapolation.hpp"
#include "models/world/split_islands.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// What can be taken over is: from the execution that the step replaces, from islands at rest, from
// a split solve, from another world of the process. All are functions of the island's whole input,
// so that the bits are the same.
class IslandAdvance {
 public:
  IslandAdvance(StepInProgress& step, DependencyWaits& waits, GhostExtrapolation& extrapolation,
                SplitIslands& splits)
      : step_(step), waits_(waits), extrapolation_(extrapolation), splits_(splits) {}

  // Every participating world solves the whole of a mixed island in canonical order and keeps its
  // own bodies: same bits, no message back. Large ones may have been split between worlds before;
  // `bag` says how they ended. Whether there are any that had not been solved in an earlier pass.
  bool advance_known_islands(kernel::VirtualTime now, Bag bag);
  // Own bodies that are in no island.
  void advance_free_bodies();

 private:
  bool advance_island(kernel::VirtualTime now, Bag bag, std::size_t island,
                      const KnownBodies& known, std::span<physics::BodyState> states);
  void begin_pass(std::span<const std::uint32_t> bodies, std::size_t manifolds, std::uint32_t pass,
                  const KnownBodies& known);
  void end_pass(std::span<const std::uint32_t> bodies, const KnownBodies& known);
  void note_owners(std::span<const std::uint32_t> bodies, const KnownBodies& known);
  void advance_own_island(std::uint32_t pass);
  bool take_resting(physics::IslandReport& report);
  void advance_mixed_island(std::int64_t step, WorldId label_owner);
  physics::IslandReport advance_gathered(physics::StageCounters& work,
                                         std::vector<physics::AdvanceFault>& faults);
  void start_warm();
  void remember_island(std::span<const std::uint32_t> bodies, const KnownBodies& known, bool mixed);

  StepInProgress& step_;
  DependencyWaits& waits_;
  GhostExtrapolation& extrapolation_;
  SplitIslands& splits_;
};

}  // namespace soda::models
