// What of its own bodies a world sends across its borders: ghosts as a step begins, migrants as it
// ends.
#pragma once

#include <cstdint>

#include "models/territory/cell_cover.hpp"
#include "models/world/dependency_waits.hpp"
#include "models/world/ghost_extrapolation.hpp"
#include "models/world/outgoing.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

class BorderTests {
 public:
  BorderTests(StepInProgress& step, DependencyWaits& waits, GhostExtrapolation& extrapolation)
      : step_(step), waits_(waits), extrapolation_(extrapolation) {}

  // Own bodies go as ghosts to every other world whose cells their swept box covers. Reads
  // scratch.boxes.
  void send_ghosts(std::int64_t step, Outgoing& out);
  // Those whose centre has left the territory go to its new owner, for the next step; here they
  // stay until that begins. Whether there are any.
  bool send_migrants(std::int64_t step, Outgoing& out);

 private:
  StepInProgress& step_;
  DependencyWaits& waits_;
  GhostExtrapolation& extrapolation_;
  CellCovers covers_;  // of own bodies
};

}  // namespace soda::models
