#include "analysis/commands/branch_command.hpp"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <memory>
#include <ostream>
#include <span>
#include <utility>

#include "analysis/branch/cone.hpp"
#include "analysis/event_log/log_writer.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/measures/input_measures.hpp"
#include "analysis/process/stop_signals.hpp"
#include "analysis/runs/input_stream.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/text/progress.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/text/version.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

void check_step(const BranchRequest& request, const LogReader& log) {
  if (request.step >= log.first_step() && request.step <= log.last_step()) return;
  throw UsageError("--step: found " + std::to_string(request.step) +
                   "; allowed: " + std::to_string(log.first_step()) + " to " +
                   std::to_string(log.last_step()) + ", the last whole step of " + request.file);
}

Overrides branch_options(const BranchRequest& request, const LogReader& log) {
  Overrides options;
  options.executor = models::ExecutorKind::kSequential;
  options.worlds = 1;
  options.steps = request.steps.value_or(log.last_step());
  return options;
}

// Adds the new inputs to the recorded run from the step on. How many they are.
std::size_t add_inputs(const BranchRequest& request, scenarios::Scenario& scenario,
                       std::ostream& err) {
  const std::size_t recorded = scenario.run.inputs.script.size();
  if (!std::filesystem::is_regular_file(request.inputs))
    throw scenarios::FileError(request.inputs + ": cannot be read: is no regular file");
  open_inputs(request.inputs, scenario, err);
  return scenario.run.inputs.script.size() - recorded;
}

std::unique_ptr<LogWriter> open_branch_log(const BranchRequest& request, const LogReader& log,
                                           const Overrides& options,
                                           const scenarios::Scenario& scenario) {
  if (request.log_file.empty()) return nullptr;
  refuse_own_input(request.log_file, request.file, "--log");
  refuse_own_input(request.log_file, request.inputs, "--log");
  auto branch = std::make_unique<LogWriter>(request.log_file, request.force);
  LoggedScenario logged = log.scenario();
  logged.program_version = kVersion;
  branch->begin(logged,
                {.overrides = options,
                 .ranks = 0,
                 .level = LogLevel::kCommits,
                 .every = 1,
                 .first_step = scenario.run.first_step},
                log.labels(), log.meshes());
  const InputFollower start(scenario.scene, scenario.initial, scenario.run.inputs);
  const auto [ids, states] = start.bodies();
  models::CommittedStep first;
  first.step = scenario.run.first_step;
  first.ids = ids;
  first.states = states;
  first.inputs = scenario.run.inputs.acted;
  if (!branch->add_committed(first)) branch->finish();  // throws
  return branch;
}

// Runs the scenario beside the log. What reading the log throws is thrown when the run has ended.
MeasuredRun run_beside(LogReader& log, const scenarios::Scenario& scenario, bool quiet,
                       kernel::StopRequest& stop, LogWriter* written, BranchReport& report) {
  BranchDifference difference;
  std::exception_ptr error;
  models::CommitObserver observer;
  observer.wants_states = true;
  observer.on_step = [&](const models::CommittedStep& step) {
    if (error) return;
    report.body_steps += step.ids.size();
    try {
      if (step.step <= log.last_step() && has_states(log.options(), step.step))
        report.differences.push_back(
            difference.add(log.read_step(step.step), step.ids, step.states));
    } catch (const std::exception&) {
      error = std::current_exception();
      stop.store(kStopForFailure);
    }
    if (written != nullptr && !written->add_committed(step)) stop.store(kStopForFailure);
  };
  MeasuredRun run = measure_run(scenario.scene, scenario.initial, scenario.territory, scenario.run,
                                observer, terminal_progress(scenario.run.steps, quiet));
  if (error) std::rethrow_exception(error);
  return run;
}

std::string step_json(const StepDifference& step) {
  return JsonObject()
      .set("step", json_of(step.step))
      .set("bodies", json_of(step.bodies))
      .set("on_one_side", json_of(step.one_side))
      .set("reach_m", json_of(step.reach_m))
      .set("deviation_m", json_of(step.deviation_m))
      .text();
}

std::string branch_json(const BranchReport& report) {
  return JsonObject()
             .set("first_step", json_of(report.first_step))
             .set("steps", json_of(report.steps))
             .set("inputs", json_of(report.inputs))
             .set("body_steps", json_of(report.body_steps))
             .set("digest", quoted(format_digest(report.digest)))
             .set("differences", list_of(report.differences, step_json))
             .text() +
         "\n";
}

std::string difference_table(const std::vector<StepDifference>& steps) {
  constexpr std::size_t kRows = 20;
  const std::size_t every = (steps.size() + kRows - 1) / kRows;
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i % every != 0 && i + 1 != steps.size()) continue;
    const StepDifference& step = steps[i];
    rows.push_back({std::to_string(step.step), std::to_string(step.bodies),
                    format_number(step.reach_m), format_number(step.deviation_m)});
  }
  return format_table({{"step", Align::kRight},
                       {"bodies that differ", Align::kRight},
                       {"reach m", Align::kRight},
                       {"deviation m", Align::kRight}},
                      rows);
}

std::string branch_text(const BranchReport& report) {
  const std::vector<StepDifference>& steps = report.differences;
  const auto first = std::ranges::find_if(steps, [](const auto& step) { return step.bodies > 0; });
  std::string text = "branch from step " + std::to_string(report.first_step) + " to step " +
                     std::to_string(report.steps) +
                     ", new inputs: " + std::to_string(report.inputs) + ", digest " +
                     format_digest(report.digest) + "\n";
  if (first == steps.end()) return text + "no step differs from the recorded one\n";
  const auto most = std::ranges::max_element(steps, {}, &StepDifference::bodies);
  return text + "differs from step " + std::to_string(first->step) + " on, in at most " +
         std::to_string(most->bodies) + " bodies (step " + std::to_string(most->step) + ")\n\n" +
         difference_table(steps);
}

// Whether the log tells of every step what single bodies did, as this program does it.
bool tells_of_bodies(const BranchRequest& request, const LogReader& log) {
  return log.options().level != LogLevel::kInputs && log.options().every == 1 &&
         request.steps.value_or(log.last_step()) <= log.last_step() &&
         log.scenario().program_version == kVersion;
}

// With the new inputs, of which there are `inputs`. Where bodies began matters only to one that
// adds one.
scenarios::Scenario scenario_of_cone(const BranchRequest& request, LogReader& log,
                                     std::size_t& inputs, std::ostream& err) {
  const std::vector<physics::BodyId> ids = SingleStates(log).ids(request.step);
  const auto read = [&](scenarios::ScenarioExtent extent) {
    Overrides options = branch_options(request, log);
    scenarios::Scenario scenario = resumed_without_states(log, request.step, ids, extent, options);
    inputs = add_inputs(request, scenario, err);
    return scenario;
  };
  scenarios::Scenario scenario = read(scenarios::ScenarioExtent::kNoStates);
  const auto added = std::span(scenario.run.inputs.script).last(inputs);
  const bool adds_bodies = std::ranges::any_of(
      added, [](const models::UserInput& input) { return input.kind == models::InputKind::kAdd; });
  return adds_bodies ? read(scenarios::ScenarioExtent::kNoWarnings) : std::move(scenario);
}

// Only what differs is computed. Nothing if that is not possible, or takes longer than the whole.
std::optional<BranchReport> branch_cone(const BranchRequest& request, LogReader& log,
                                        kernel::StopRequest& stop, std::ostream& err) {
  BranchReport report;
  report.first_step = request.step;
  const scenarios::Scenario scenario = scenario_of_cone(request, log, report.inputs, err);
  const auto progress = terminal_progress(scenario.run.steps, request.quiet);
  Cone cone(log, scenario);
  while (cone.step() < scenario.run.steps && stop.load() == 0) {
    if (!cone.advance()) return std::nullopt;
    report.differences.push_back(cone.difference());
    if (progress) progress({.committed_step = cone.step()});
  }
  report.steps = cone.step();
  report.body_steps = cone.body_steps();
  report.digest = cone.digest();
  report.stopped = cone.step() < scenario.run.steps ? stop.load() : 0;
  return report;
}

BranchReport branch_whole(const BranchRequest& request, LogReader& log, kernel::StopRequest& stop,
                          std::ostream& err) {
  BranchReport report;
  Overrides options = branch_options(request, log);
  scenarios::Scenario scenario = resumed_scenario(log, request.step, options);
  report.inputs = add_inputs(request, scenario, err);
  scenario.run.stop = &stop;
  const std::unique_ptr<LogWriter> written = open_branch_log(request, log, options, scenario);
  const MeasuredRun run = run_beside(log, scenario, request.quiet, stop, written.get(), report);
  report.first_step = request.step;
  report.steps = run.result.committed_steps;
  report.digest = run.digest;
  report.stopped = run.result.stopped;
  if (written) written->finish();
  return report;
}

}  // namespace

int branch_command(const BranchRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  check_step(request, log);
  kernel::StopRequest stop{0};
  const StopOnSignals signals(stop);
  std::optional<BranchReport> found;
  if (request.log_file.empty() && tells_of_bodies(request, log))
    found = branch_cone(request, log, stop, err);
  const BranchReport report = found ? *found : branch_whole(request, log, stop, err);
  out << (request.json ? branch_json(report) : branch_text(report));
  if (report.stopped != 0)
    return report.stopped == kStopForFailure ? kExitFile
                                             : kExitSignal + static_cast<int>(report.stopped);
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
