#include "analysis/logged_run.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/warnings.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {

scenarios::Scenario logged_scenario(LogReader& log, const Overrides& more) {
  const Overrides overrides = combined(log.overrides(), more);
  scenarios::Scenario scenario =
      scenarios::read_scenario_text(log.scenario().text, log.scenario().file, overrides.seed);
  if (overrides.strict) refuse_warnings(log.scenario().file, scenario.warnings);
  apply_overrides(overrides, scenario.territory, scenario.run);
  if (!log.complete()) scenario.run.steps = std::min(scenario.run.steps, log.last_step());
  scenario.run.inputs.script.clear();
  for (std::int64_t step = 0; step <= log.last_step(); ++step)
    for (const models::CommittedInput& committed : log.read_step(step).inputs)
      if (physics::index_of(committed.input.body) < scenario.initial.size())
        scenario.run.inputs.script.push_back(committed.input);
  return scenario;
}

void tell_flaws(const LogReader& log, const std::string& file, std::ostream& err) {
  if (!log.cut().empty())
    err << "soda: " << file << ": " << log.cut() << "; read up to step " << log.last_step() << "\n";
  if (!log.damage().empty()) err << "soda: " << file << ": damaged: " << log.damage() << "\n";
}

}  // namespace soda::analysis
