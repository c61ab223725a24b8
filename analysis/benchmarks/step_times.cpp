// step_times FILE...: processor time of each step of the plain loop with its inputs, the least of
// three runs: the median and the worst of the steps in which something was solved, and what the
// worst is over the median. For scenes of which no step should hold up a clock.
#include <time.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "analysis/measures/error_measures.hpp"
#include "models/user_input/user_input.hpp"
#include "physics/step/step.hpp"
#include "scenarios/read_scenario.hpp"

namespace {

using namespace soda;

constexpr int kRuns = 3;

double now_ms() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct TimedStep {
  double time_ms = 1e300;
  bool solved = false;
};

// With the scenario's inputs; what is at rest is not solved again, as in a run.
void time_steps(const scenarios::Scenario& scenario, std::vector<TimedStep>& steps) {
  const physics::Geometry geometry(scenario.scene);
  physics::SceneDescription scene = scenario.scene;  // materials change
  std::vector<models::UserInput> inputs = scenario.run.inputs.script;
  std::sort(inputs.begin(), inputs.end(), models::acts_before);
  models::Presence presence(scenario.run.inputs.absent);
  std::vector<physics::BodyId> ids;
  std::vector<physics::BodyState> states;
  for (const physics::BodyId id : analysis::all_ids(scenario.initial.size())) {
    if (!presence.has(id)) continue;
    ids.push_back(id);
    states.push_back(scenario.initial[physics::index_of(id)]);
  }
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  auto input = inputs.begin();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    for (; input != inputs.end() && input->step <= static_cast<std::int64_t>(i); ++input)
      if (presence.note(*input)) models::act_on_scene(*input, scene, ids, states);
    const std::uint64_t solved = counters.islands_solved;
    const double begin = now_ms();
    physics::step(scene, geometry, ids, states, {scratch, report, counters});
    steps[i].time_ms = std::min(steps[i].time_ms, now_ms() - begin);
    steps[i].solved = counters.islands_solved > solved;
  }
}

void print(const std::string& file, const std::vector<TimedStep>& steps) {
  std::vector<double> solved;
  std::size_t worst = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!steps[i].solved) continue;
    solved.push_back(steps[i].time_ms);
    if (steps[i].time_ms > steps[worst].time_ms || !steps[worst].solved) worst = i;
  }
  if (solved.empty()) {
    std::printf("%-44s no step solves anything\n", file.c_str());
    return;
  }
  const auto middle = solved.begin() + static_cast<std::ptrdiff_t>(solved.size() / 2);
  std::nth_element(solved.begin(), middle, solved.end());
  std::printf("%-44s median %9.4f ms  worst %9.4f ms at step %5zu  %7.1f times\n", file.c_str(),
              *middle, steps[worst].time_ms, worst + 1, steps[worst].time_ms / *middle);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: step_times FILE...\n";
    return 2;
  }
  try {
    for (int i = 1; i < argc; ++i) {
      const scenarios::Scenario scenario = scenarios::read_scenario_file(argv[i]);
      std::vector<TimedStep> steps(static_cast<std::size_t>(scenario.run.steps));
      for (int run = 0; run < kRuns; ++run) time_steps(scenario, steps);
      print(argv[i], steps);
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "step_times: " << error.what() << "\n";
    return 2;
  }
}
