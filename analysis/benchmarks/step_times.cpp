// step_times FILE...: processor time of each step of the plain loop, the least of three runs: the
// median and the worst of the steps in which something was solved, and what the worst is over the
// median. For scenes of which no step should hold up a clock.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "analysis/measures/error_measures.hpp"
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

void time_steps(const scenarios::Scenario& scenario, std::vector<TimedStep>& steps) {
  const physics::Geometry geometry(scenario.scene);
  const std::vector<physics::BodyId> ids = analysis::all_ids(scenario.initial.size());
  std::vector<physics::BodyState> states = scenario.initial;
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  for (TimedStep& step : steps) {
    const std::uint64_t solved = counters.islands_solved;
    const double begin = now_ms();
    physics::step(scenario.scene, geometry, ids, states, {scratch, report, counters});
    step.time_ms = std::min(step.time_ms, now_ms() - begin);
    step.solved = counters.islands_solved > solved;
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
