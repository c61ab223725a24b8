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
  // With these inputs instead of the scenario's.
  PlainLoop(const scenarios::Scenario& scenario, std::vector<models::UserInput> inputs);

  std::uint64_t digest_after(std::int64_t steps) const;
  // The bodies that are there, by id. Runs again from the start.
  struct Bodies {
    std::vector<physics::BodyId> ids;
    std::vector<physics::BodyState> states;
  };
  Bodies after(std::int64_t steps);

 private:
  void restart();
  void advance();

  const scenarios::Scenario& scenario_;
  const physics::Geometry geometry_;
  std::vector<models::UserInput> inputs_;  // in the order of acting

  physics::SceneDescription scene_;  // materials change
  Bodies bodies_;
  models::Presence presence_{{}};
  std::int64_t step_ = 0;
  std::size_t next_input_ = 0;
  physics::StepScratch scratch_;
  physics::StepReport report_;
  physics::StageCounters counters_;
  std::vector<std::uint64_t> digests_;
};

}  // namespace soda::analysis
