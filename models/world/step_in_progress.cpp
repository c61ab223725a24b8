#include "models/world/step_in_progress.hpp"

namespace soda::models {

void StepInProgress::start(const Rules& rules_of_step) {
  rules = rules_of_step;
  ghosts.clear();
  merge = {};
  solves = 0;
  scratch.manifolds.clear();
  report.islands.clear();
  report.faults.clear();
}

std::vector<physics::BodyState> StepInProgress::states_at_start() const {
  std::vector<physics::BodyState> started;
  started.reserve(ids.size());
  for (std::uint32_t i = 0; i < ids.size(); ++i)
    started.push_back(scratch.passes.start_of(i, states[i]));
  return started;
}

void StepInProgress::count_repetition(bool taken, std::size_t bodies) {
  if (!repetition.repeats()) return;
  WorldCounters& counters = work.worlds;
  ++(taken ? counters.islands_taken : counters.islands_repeated);
  (taken ? counters.bodies_taken : counters.bodies_repeated) += bodies;
}

}  // namespace soda::models
