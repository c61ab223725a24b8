#include "analysis/runs/plain_loop.hpp"

#include <algorithm>
#include <utility>

#include "physics/measures/measures.hpp"

namespace soda::analysis {

PlainLoop::PlainLoop(const scenarios::Scenario& scenario)
    : PlainLoop(scenario, scenario.run.inputs.script) {}

PlainLoop::PlainLoop(const scenarios::Scenario& scenario, std::vector<models::UserInput> inputs,
                     const PlainLimits& limits)
    : scenario_(scenario), geometry_(scenario.scene), inputs_(std::move(inputs)) {
  std::sort(inputs_.begin(), inputs_.end(), models::acts_before);
  restart();
  digests_.push_back(physics::digest(bodies_.ids, bodies_.states));
  while (step_ < scenario.run.steps && work_of(counters_) < limits.work) {
    advance();
    if (limits.stop_at_fault && fault_) return;
    if (limits.watch) limits.watch(bodies_.ids, bodies_.states);
    digests_.push_back(physics::digest(bodies_.ids, bodies_.states));
  }
}

std::uint64_t PlainLoop::digest_after(std::int64_t steps) const {
  return digests_[static_cast<std::size_t>(steps)];
}

PlainLoop::Bodies PlainLoop::after(std::int64_t steps) {
  restart();
  while (step_ < steps) advance();
  return bodies_;
}

void PlainLoop::restart() {
  scene_ = scenario_.scene;
  presence_ = models::Presence(scenario_.run.inputs.absent);
  bodies_ = {};
  for (std::uint32_t i = 0; i < scenario_.initial.size(); ++i) {
    if (!presence_.has(physics::BodyId{i})) continue;
    bodies_.ids.push_back(physics::BodyId{i});
    bodies_.states.push_back(scenario_.initial[i]);
  }
  step_ = 0;
  next_input_ = 0;
}

void PlainLoop::advance() {
  for (; next_input_ < inputs_.size() && inputs_[next_input_].step <= step_; ++next_input_)
    if (presence_.note(inputs_[next_input_]))
      models::act_on_scene(inputs_[next_input_], scene_, bodies_.ids, bodies_.states);
  scratch_.resting.forget();  // an oracle takes nothing over
  physics::step(scene_, geometry_, bodies_.ids, bodies_.states, {scratch_, report_, counters_});
  if (!fault_ && !report_.faults.empty()) note_fault();
  ++step_;
}

void PlainLoop::note_fault() {
  const auto least =
      std::ranges::min_element(report_.faults, {}, [](const auto& fault) { return fault.body; });
  fault_ = PlainFault{step_, scene_.bodies[physics::index_of(least->body)].label, least->what};
}

std::uint64_t work_of(const physics::StageCounters& counters) {
  std::uint64_t tests = 0;
  for (const std::uint64_t count : counters.narrowphase_tests) tests += count;
  return 1000 * tests + 500 * counters.candidate_pairs + 500 * counters.boxes +
         60 * counters.row_sweeps + 2 * counters.factor_multiplications +
         500 * counters.joint_rows + 2000 * counters.islands_solved;
}

}  // namespace soda::analysis
