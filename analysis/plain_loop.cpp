#include "analysis/plain_loop.hpp"

#include "analysis/error_measures.hpp"
#include "physics/measures.hpp"

namespace soda::analysis {

PlainLoop::PlainLoop(const scenarios::Scenario& scenario)
    : scene_(scenario.scene),
      initial_(scenario.initial),
      geometry_(scenario.scene),
      ids_(all_ids(scenario.initial.size())) {
  std::vector<physics::BodyState> states = initial_;
  for (std::int64_t step = 0; step < scenario.run.steps; ++step) {
    advance(states);
    digests_.push_back(physics::digest(ids_, states));
  }
}

std::uint64_t PlainLoop::digest_after(std::int64_t steps) const {
  return steps == 0 ? physics::digest(ids_, initial_)
                    : digests_[static_cast<std::size_t>(steps - 1)];
}

std::vector<physics::BodyState> PlainLoop::states_after(std::int64_t steps) {
  std::vector<physics::BodyState> states = initial_;
  for (std::int64_t step = 0; step < steps; ++step) advance(states);
  return states;
}

void PlainLoop::advance(std::vector<physics::BodyState>& states) {
  physics::step(scene_, geometry_, ids_, states, scratch_, report_, counters_);
}

}  // namespace soda::analysis
