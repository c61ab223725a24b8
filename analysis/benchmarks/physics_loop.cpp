// physics_loop FILE [STEPS]: the bare loop over physics::step that `soda run` with one world is
// compared with, instruction by instruction. Reads the same file with the same reader, measures the
// same errors, prints the same digest; has no worlds, no kernel, no command line.
#include <cstdlib>
#include <iostream>
#include <string>

#include "analysis/measures/error_measures.hpp"
#include "analysis/text/text_table.hpp"
#include "physics/measures/measures.hpp"
#include "physics/step/step.hpp"
#include "scenarios/read_scenario.hpp"

namespace {

int run(const std::string& file, const char* steps_text) {
  using namespace soda;
  const scenarios::Scenario scenario = scenarios::read_scenario_file(file);
  const std::int64_t steps =
      steps_text != nullptr ? std::strtoll(steps_text, nullptr, 10) : scenario.run.steps;
  const physics::Geometry geometry(scenario.scene);
  const std::vector<physics::BodyId> ids = analysis::all_ids(scenario.initial.size());
  std::vector<physics::BodyState> states = scenario.initial;
  physics::StepScratch scratch;
  physics::StepReport report;
  physics::StageCounters counters;
  analysis::RunTotals totals;
  for (std::int64_t step = 0; step < steps; ++step) {
    analysis::add_drives(scenario.scene, ids, states, totals);
    physics::step(scenario.scene, geometry, ids, states, {scratch, report, counters});
    analysis::add_islands(report.islands, totals);
  }
  const analysis::ErrorMeasures error = analysis::measure_errors(
      scenario.scene, scenario.initial, states, static_cast<double>(steps), totals);
  std::cout << "digest " << analysis::format_digest(physics::digest(ids, states))
            << "\nenergy_drift_rel " << analysis::format_exact(error.energy_drift_rel)
            << "\nmomentum_drift_rel " << analysis::format_exact(error.momentum_drift_rel) << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: physics_loop FILE [STEPS]\n";
    return 2;
  }
  try {
    return run(argv[1], argc == 3 ? argv[2] : nullptr);
  } catch (const std::exception& error) {
    std::cerr << "physics_loop: " << error.what() << "\n";
    return 2;
  }
}
