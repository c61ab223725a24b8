// The oracle of a scenario: the plain loop over physics::step.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/geometry.hpp"
#include "physics/step.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// No worlds, no kernel, nothing shared with what it judges. `scenario` must outlive this object.
class PlainLoop {
 public:
  // Runs scenario.run.steps steps and keeps their digests.
  explicit PlainLoop(const scenarios::Scenario& scenario);

  std::uint64_t digest_after(std::int64_t steps) const;
  // Runs again from the start.
  std::vector<physics::BodyState> states_after(std::int64_t steps);

 private:
  void advance(std::vector<physics::BodyState>& states);

  const physics::SceneDescription& scene_;
  const std::vector<physics::BodyState>& initial_;
  const physics::Geometry geometry_;
  const std::vector<physics::BodyId> ids_;
  physics::StepScratch scratch_;
  physics::StepReport report_;
  physics::StageCounters counters_;
  std::vector<std::uint64_t> digests_;
};

}  // namespace soda::analysis
