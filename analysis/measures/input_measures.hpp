// What user input does to energy and momentum: so that errors are measured without it.
#pragma once

#include <span>
#include <vector>

#include "analysis/measures/error_measures.hpp"
#include "models/commit/commit.hpp"

namespace soda::analysis {

// Whether bodies come and go, or are pushed, so that a run must be followed step by step.
bool is_followed(const models::InputOptions& inputs);

// Follows the committed steps of a run: repeats the effect of each input on the state before it.
// Holds one copy of the states.
class InputFollower {
 public:
  // `scene` must outlive this object.
  InputFollower(const physics::SceneDescription& scene, std::span<const physics::BodyState> initial,
                const models::InputOptions& inputs);

  // The bodies that are there, before the first step.
  PresentBodies bodies() const { return {ids_, states_}; }

  // For each committed step, in order, with its states. Adds to `totals` what inputs and drives did
  // in it, and the mass that was missing.
  void follow(const models::CommittedStep& step, RunTotals& totals);

 private:
  void add(const models::UserInput& input, RunTotals& totals);

  const physics::SceneDescription& scene_;
  physics::SceneDescription changed_;  // materials do not count, but change
  std::vector<physics::BodyId> ids_;
  std::vector<physics::BodyState> states_;
};

}  // namespace soda::analysis
