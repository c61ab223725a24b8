#include "analysis/commands/rollback_command.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/commands/json_output.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

using physics::BodyId;
using physics::BodyState;

// What the bodies of one committed step do; of impulses, a digest is enough.
struct ExactStep {
  std::uint64_t digest = 0;
  std::vector<BodyId> ids;
  std::vector<physics::Vec3> positions_m, velocities_m_s;
};

std::vector<ExactStep> exact_steps(const scenarios::Scenario& scenario) {
  std::vector<ExactStep> steps;
  const models::CommitObserver observer{
      .wants_states = true, .on_step = [&steps](const models::CommittedStep& step) {
        ExactStep exact{
            physics::digest(step.ids, step.states), {step.ids.begin(), step.ids.end()}, {}, {}};
        for (const BodyState& state : step.states) {
          exact.positions_m.push_back(state.position_m);
          exact.velocities_m_s.push_back(state.linear_velocity_m_s);
        }
        steps.push_back(std::move(exact));
      }};
  models::TerritoryOptions undivided = scenario.territory;
  undivided.worlds = 1;
  measure_run(scenario.scene, scenario.initial, undivided,
              {.steps = scenario.run.steps, .inputs = scenario.run.inputs}, observer, {});
  return steps;
}

void compare(const ExactStep& exact, const models::CommittedStep& found, ModeMeasures& mode) {
  if (physics::digest(found.ids, found.states) == exact.digest) return;
  if (!mode.first_different_step) mode.first_different_step = found.step;
  // Who is there is decided by user input alone, so the lists are the same.
  for (std::size_t i = 0; i < std::min(found.ids.size(), exact.ids.size()); ++i) {
    const BodyState& state = found.states[i];
    mode.position_deviation_m =
        std::max(mode.position_deviation_m, (state.position_m - exact.positions_m[i]).norm());
    mode.velocity_deviation_m_s = std::max(
        mode.velocity_deviation_m_s, (state.linear_velocity_m_s - exact.velocities_m_s[i]).norm());
  }
}

ModeMeasures measure(const scenarios::Scenario& scenario, const std::vector<ExactStep>& exact,
                     models::RollbackMode which) {
  ModeMeasures mode;
  mode.mode = which;
  models::RunOptions options = scenario.run;
  options.rollback = which;
  const models::CommitObserver observer{
      .wants_states = true, .on_step = [&](const models::CommittedStep& step) {
        compare(exact[static_cast<std::size_t>(step.step - 1)], step, mode);
      }};
  const MeasuredRun run =
      measure_run(scenario.scene, scenario.initial, scenario.territory, options, observer, {});
  const models::SimulationResult& result = run.result;
  mode.rollbacks = result.events.rollbacks;
  mode.steps_repeated = result.worlds.steps_repeated;
  mode.islands_solved = result.stages.islands_solved;
  mode.islands_wasted = result.stages.islands_advanced() - result.islands_committed;
  mode.islands_warm = result.worlds.islands_warm;
  mode.iterations = result.stages.solver_iterations;
  mode.makespan_s = 1e-9 * static_cast<double>(result.cluster->makespan_ns);
  mode.cpu_s = run.cost.cpu_s;
  return mode;
}

std::string text(const RollbackReport& report) {
  const auto right = [](const char* title) { return Column{title, Align::kRight}; };
  std::vector<std::vector<std::string>> rows;
  for (const ModeMeasures& mode : report.modes)
    rows.push_back(
        {name_of(mode.mode), std::to_string(mode.rollbacks), std::to_string(mode.steps_repeated),
         std::to_string(mode.islands_solved), std::to_string(mode.islands_wasted),
         std::to_string(mode.islands_warm), std::to_string(mode.iterations),
         format_number(1e3 * mode.makespan_s), format_number(1e3 * mode.cpu_s),
         mode.first_different_step ? std::to_string(*mode.first_different_step) : "-",
         format_number(mode.position_deviation_m), format_number(mode.velocity_deviation_m_s)});
  return report.scenario + ", " + std::to_string(report.steps) + " steps, " +
         std::to_string(report.worlds) + " worlds on the virtual cluster\n\n" +
         format_table({{"rollback"},
                       right("rollbacks"),
                       right("steps again"),
                       right("solves"),
                       right("wasted"),
                       right("warm"),
                       right("iterations"),
                       right("makespan ms"),
                       right("CPU ms"),
                       right("first different step"),
                       right("off by m"),
                       right("m/s")},
                      rows);
}

}  // namespace

RollbackReport compare_rollbacks(const RollbackRequest& request) {
  scenarios::Scenario scenario = load_scenario(request.file, request.overrides);
  scenario.run.executor = models::ExecutorKind::kVirtual;
  RollbackReport report{scenario.name,
                        scenario.run.steps,
                        scenario.territory.worlds,
                        {},
                        {request.file, scenario.warnings}};
  const std::vector<ExactStep> exact = exact_steps(scenario);
  for (const models::RollbackMode mode :
       {models::RollbackMode::kPropagate, models::RollbackMode::kInvalidate,
        models::RollbackMode::kWarm})
    report.modes.push_back(measure(scenario, exact, mode));
  return report;
}

int rollback_command(const RollbackRequest& request, std::ostream& out, std::ostream& err) {
  const RollbackReport report = compare_rollbacks(request);
  tell_warnings({report.warnings}, err);
  out << (request.json ? rollback_json(report) : text(report));
  return kExitOk;
}

}  // namespace soda::analysis
