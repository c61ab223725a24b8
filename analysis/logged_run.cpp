#include "analysis/logged_run.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/warnings.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

[[noreturn]] void refuse(const LogReader& log, const std::string& why) {
  throw scenarios::FileError(log.file() + ": " + why + ", which the logged scenario does not have");
}

void check_bodies(const LogReader& log, const scenarios::Scenario& scenario) {
  const std::vector<physics::BodyParams>& bodies = scenario.scene.bodies;
  const std::vector<std::uint32_t>& labels = log.labels();
  if (labels.size() != bodies.size())
    refuse(log, "block 2 lists " + std::to_string(labels.size()) + " bodies");
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i] != bodies[i].label)
      refuse(log, "block 2 lists body " + std::to_string(labels[i]));
}

// `worlds` of the logged run: a replay may have others.
void check_territories(const LogReader& log, const LoggedStep& step, std::size_t cells,
                       std::uint32_t worlds) {
  for (const models::TerritoryChange& change : step.territory_changes) {
    if (change.cell >= cells)
      refuse(log, log.place_of(step.step) + " gives away cell " + std::to_string(change.cell));
    for (const models::WorldId world : {change.from, change.to})
      if (models::index_of(world) >= worlds)
        refuse(log,
               log.place_of(step.step) + " names world " + std::to_string(models::index_of(world)));
  }
}

void check_motors(const LogReader& log, const LoggedStep& step,
                  const std::vector<physics::Joint>& joints) {
  for (const models::CommittedInput& committed : step.inputs) {
    const models::UserInput& input = committed.input;
    if (input.kind != models::InputKind::kSetMotor) continue;
    if (input.joint >= joints.size() || !joints[input.joint].motor)
      refuse(log, log.place_of(step.step) + " has an input for a motor that is not there");
  }
}

// A replay need not be started by mpirun: then as many threads stand for a job.
Overrides options_of_run(const LoggedOptions& logged) {
  Overrides overrides = logged.overrides;
  if (logged.ranks == 0) return overrides;
  constexpr unsigned kMostThreads = 1024;  // as on the command line
  overrides.executor = models::ExecutorKind::kThreads;
  overrides.threads = static_cast<unsigned>(std::min<std::uint64_t>(
      kMostThreads, std::uint64_t{logged.ranks} * overrides.threads.value_or(1)));
  return overrides;
}

// As far as it was asked to run.
scenarios::Scenario scenario_of(const LogReader& log, const Overrides& overrides) {
  const scenarios::MeshFiles meshes{.folder = "", .kept = &log.meshes(), .read = nullptr};
  scenarios::Scenario scenario = scenarios::read_scenario_text(
      log.scenario().text, log.scenario().file, overrides.seed, meshes);
  if (overrides.strict) refuse_warnings(log.scenario().file, scenario.warnings);
  check_bodies(log, scenario);
  return scenario;
}

}  // namespace

scenarios::Scenario logged_scenario(LogReader& log, const Overrides& more) {
  const Overrides own = options_of_run(log.options());
  const Overrides overrides = combined(own, more);
  scenarios::Scenario scenario = scenario_of(log, overrides);
  const std::uint32_t worlds = own.worlds.value_or(scenario.territory.worlds);
  apply_overrides(overrides, scenario.territory, scenario.run);
  scenario.run.steps = std::min(scenario.run.steps, log.last_step());
  scenario.run.inputs.script.clear();
  const std::size_t cells = scenario.territory.grid.cell_count();
  for (std::int64_t step = 0; step <= log.last_step(); ++step) {
    const LoggedStep logged = log.read_step(step);
    check_territories(log, logged, cells, worlds);
    check_motors(log, logged, scenario.scene.joints);
    for (const models::CommittedInput& committed : logged.inputs)
      scenario.run.inputs.script.push_back(committed.input);
  }
  return scenario;
}

std::int64_t asked_steps(const LogReader& log) {
  return log.options().overrides.steps.value_or(
      scenario_of(log, options_of_run(log.options())).run.steps);
}

void tell_flaws(const LogReader& log, const std::string& file, std::ostream& err) {
  if (!log.cut().empty())
    err << "soda: " << file << ": " << log.cut() << "; read up to step " << log.last_step() << "\n";
  if (!log.damage().empty()) err << "soda: " << file << ": damaged: " << log.damage() << "\n";
}

}  // namespace soda::analysis
