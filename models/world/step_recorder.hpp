// What a step leaves: the memo for its repetition, and the next entry of the transform buffer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "models/transform_buffer/transform_buffer.hpp"
#include "models/world/dependency_waits.hpp"
#include "models/world/ghost_extrapolation.hpp"
#include "models/world/outgoing.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// Knows, too, whether the step is a repetition: Rollback and Propagate compares it with the stale
// entry that it wrote before.
class StepRecorder {
 public:
  StepRecorder(StepInProgress& step, TransformBuffer& buffer, DependencyWaits& waits,
               GhostExtrapolation& extrapolation)
      : step_(step), buffer_(buffer), waits_(waits), extrapolation_(extrapolation) {}

  // As soon as own bodies and map are those of the step. `migrants`: of the own bodies, those that
  // have just come. Then note_inputs(), once user input has acted; `touched` by it, ascending.
  void start(std::int64_t step, std::vector<Migrant> migrants);
  void note_inputs(std::vector<physics::BodyId> touched);
  // Contacts that this world has tested, before the merge rounds add what others have tested;
  // `for_others`: those between ghosts.
  void remember_contacts(std::int64_t step, std::span<const physics::ContactManifold> for_others);
  // Writes entry step + 1; the step's bodies and what it leaves go there. Worlds to which the step
  // has mattered are warned if it came out differently. `keeps_history`: it is stored at once.
  void write_entry(std::int64_t step, bool somebody_leaves, bool keeps_history, Outgoing& out);

 private:
  bool differs_from(const StoredEntry& stale);
  std::int64_t spent_since_last_entry();

  StepInProgress& step_;
  TransformBuffer& buffer_;
  DependencyWaits& waits_;
  GhostExtrapolation& extrapolation_;
  WorkReading work_at_entry_;  // when the last entry was written; only for samples
};

}  // namespace soda::models
