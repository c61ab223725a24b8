#include "analysis/run_command.hpp"

#include <unistd.h>

#include <filesystem>
#include <memory>
#include <new>
#include <ostream>
#include <stdexcept>

#include "analysis/exit_codes.hpp"
#include "analysis/input_measures.hpp"
#include "analysis/input_stream.hpp"
#include "analysis/json_output.hpp"
#include "analysis/log_writer.hpp"
#include "analysis/logged_run.hpp"
#include "analysis/output_file.hpp"
#include "analysis/progress.hpp"
#include "analysis/run_report.hpp"
#include "analysis/stop_signals.hpp"
#include "analysis/text_table.hpp"
#include "analysis/version.hpp"
#include "analysis/view_command.hpp"
#include "analysis/warnings.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// A log must hold exactly what is run, so that is read once, here.
struct ScenarioFiles {
  std::string text;
  std::vector<scenarios::MeshFile> meshes;
};

scenarios::Scenario load_with_files(const RunRequest& request, ScenarioFiles& files) {
  files.text = scenarios::read_text(request.file);
  scenarios::Scenario scenario =
      scenarios::read_scenario_text(files.text, request.file, request.overrides.seed,
                                    {.folder = "", .kept = nullptr, .read = &files.meshes});
  if (request.overrides.strict) refuse_warnings(request.file, scenario.warnings);
  apply_overrides(request.overrides, scenario.territory, scenario.run);
  return scenario;
}

LogLevel level_of(const RunRequest& request) {
  return request.log_level.value_or(LogLevel::kCommits);
}

LoggedStep logged(const RunRequest& request, const models::CommittedStep& step) {
  LoggedStep logged{
      .step = step.step,
      .digest = physics::digest(step.ids, step.states),
      .has_states = false,
      .ids = {},
      .states = {},
      .inputs = {step.inputs.begin(), step.inputs.end()},
      .territory_changes = {step.territory_changes.begin(), step.territory_changes.end()}};
  logged.has_states =
      has_states({{}, 0, level_of(request), request.log_every.value_or(1)}, step.step);
  if (!logged.has_states) return logged;
  logged.ids.assign(step.ids.begin(), step.ids.end());
  logged.states.assign(step.states.begin(), step.states.end());
  return logged;
}

std::unique_ptr<LogWriter> open_log(const RunRequest& request, const ScenarioFiles& files,
                                    const scenarios::Scenario& scenario) {
  std::vector<std::uint32_t> labels;
  for (const physics::BodyParams& body : scenario.scene.bodies) labels.push_back(body.label);
  refuse_own_input(request.log_file, request.file, "--log");
  auto log = std::make_unique<LogWriter>(request.log_file, request.force);
  const kernel::Transport* const job = request.overrides.transport;
  log->begin(
      {kVersion, std::filesystem::absolute(request.file).string(), files.text, scenario.scene.dt_s},
      {request.overrides, job == nullptr ? 0 : job->size(), level_of(request),
       request.log_every.value_or(1)},
      labels, files.meshes);
  const InputFollower start(scenario.scene, scenario.initial, scenario.run.inputs);
  const auto [ids, states] = start.bodies();
  models::CommittedStep first;
  first.ids = ids;
  first.states = states;
  const bool written = log->add_step(logged(request, first));
  if (!written) log->finish();  // throws
  return log;
}

bool wants_trace(const RunRequest& request) {
  return !request.log_file.empty() && level_of(request) == LogLevel::kTrace;
}

void run_observed(const RunRequest& request, const scenarios::Scenario& scenario, LogWriter* log,
                  kernel::StopRequest& stop, RunReport& report) {
  std::optional<RealTimeSession> session;
  if (request.real_time) session.emplace(*request.real_time, scenario);
  models::CommitObserver observer;
  observer.wants_states = log != nullptr || request.step_digests || session;
  if (observer.wants_states) {
    observer.on_step = [&](const models::CommittedStep& step) {
      if (session) session->add(step);
      if (log == nullptr && !request.step_digests) return;
      if (request.step_digests)
        report.step_digests.push_back(physics::digest(step.ids, step.states));
      if (log != nullptr && !log->add_step(logged(request, step))) stop.store(kStopForFailure);
    };
  }
  observer.wants_trace = wants_trace(request);
  observer.on_trace = [&](std::span<const std::byte> chunk) {
    if (!log->add_trace(chunk)) stop.store(kStopForFailure);
  };
  if (session) session->start();
  report.run = measure_run(scenario.scene, scenario.initial, scenario.territory,
                           session ? session->paced(scenario.run) : scenario.run, observer,
                           terminal_progress(scenario.run.steps, request.quiet));
  if (session) report.real_time = session->finish();
}

// A warm rollback's bits depend on when messages came.
void refuse_warm_where_bits_count(const RunRequest& request) {
  if (request.overrides.rollback != models::RollbackMode::kWarm) return;
  if (!request.log_file.empty() || !request.view_file.empty())
    throw UsageError("--log: what --rollback warm does has no replay");
  if (request.overrides.cluster.check_purity)
    throw UsageError("--check-purity: --rollback warm is not pure");
}

// What a run needs follows from what it is asked for, so that is named.
std::string asked_for(const scenarios::Scenario& scenario) {
  return std::to_string(scenario.initial.size()) + " bodies in " +
         std::to_string(scenario.territory.worlds) + " worlds of " +
         std::to_string(scenario.territory.grid.cell_count()) + " cells, with buffers of " +
         std::to_string(scenario.run.buffer) + " entries";
}

void run_within_memory(const RunRequest& request, const scenarios::Scenario& scenario,
                       LogWriter* log, kernel::StopRequest& stop, RunReport& report) {
  const std::string what_for = asked_for(scenario);
  try {
    run_observed(request, scenario, log, stop, report);
  } catch (const std::bad_alloc&) {
    throw OutOfMemory(what_for);
  } catch (const std::length_error&) {
    throw OutOfMemory(what_for);
  } catch (const NumericalFailure&) {
    if (log != nullptr) log->finish();  // what led there is of use
    throw;
  }
}

void print(const RunReport& report, bool as_json, std::ostream& out) {
  out << (as_json ? run_json(report) : run_text(report));
  if (as_json) return;
  for (std::size_t i = 0; i < report.step_digests.size(); ++i)
    out << "step " << i + 1 << " " << format_digest(report.step_digests[i]) << "\n";
}

// On a rank that is not the root.
int run_own_worlds(const RunRequest& request, const scenarios::Scenario& scenario) {
  models::CommitObserver observer;
  observer.wants_states =
      !request.log_file.empty() || !request.view_file.empty() || request.step_digests;
  observer.wants_trace = wants_trace(request);
  take_part(scenario.scene, scenario.initial, scenario.territory, scenario.run, observer);
  return kExitOk;
}

// Closes the log; false if that, or writing it, failed, which is told.
bool finish(LogWriter* log, const RunReport& report, std::ostream& err) {
  if (log == nullptr) return true;
  const models::SimulationResult& result = report.run.result;
  // A replay gets inputs as messages of other times, and of a part of a run it executes another.
  const bool is_repeatable = result.stopped == 0 && !report.options.inputs.any();
  try {
    if (result.cluster && is_repeatable) log->set_execution(result.cluster->execution_digest);
    log->finish();
  } catch (const scenarios::FileError& error) {
    err << "soda: " << error.what() << "\n";
    return false;
  }
  return true;
}

// What a page needs and nobody has asked to keep.
struct TemporaryLog {
  std::string file;

  ~TemporaryLog() {
    std::error_code ignored;
    if (!file.empty()) std::filesystem::remove(file, ignored);
  }
};

// The page is made when the run is over, but that it can be written is known before.
std::unique_ptr<OutputFile> open_page(RunRequest& request, TemporaryLog& own) {
  if (request.view_file.empty()) return nullptr;
  if (level_of(request) == LogLevel::kInputs)
    throw UsageError("--view: --log-level inputs leaves out the states that it shows");
  refuse_own_input(request.view_file, request.file, "--view");
  auto page = std::make_unique<OutputFile>(request.view_file, request.force);
  if (!request.log_file.empty()) return page;
  own.file = request.log_file = request.view_file + "." + std::to_string(getpid()) + ".sodalog";
  return page;
}

}  // namespace

int run_command(const RunRequest& given, std::ostream& out, std::ostream& err) {
  ScenarioFiles files;
  scenarios::Scenario scenario = load_with_files(given, files);
  refuse_warm_where_bits_count(given);
  if (given.real_time) require_paceable(scenario.run);
  tell_warnings({{given.file, scenario.warnings}}, err);
  const std::unique_ptr<InputStream> stream = open_inputs(given.inputs, scenario, err);
  RunRequest request = given;
  if (request.log_file.empty()) request.log_file = scenario.output.log_file;
  request.step_digests = request.step_digests || scenario.output.step_digests;
  if (request.log_file.empty() && (request.log_level || request.log_every))
    throw UsageError("--log-level, --log-every: there is no --log");
  kernel::StopRequest stop{0};
  const StopOnSignals signals(stop);
  scenario.run.stop = &stop;
  if (request.overrides.transport != nullptr && !request.overrides.transport->is_root())
    return run_own_worlds(request, scenario);
  TemporaryLog own_log;
  const std::unique_ptr<OutputFile> page = open_page(request, own_log);
  const std::unique_ptr<LogWriter> log =
      request.log_file.empty() ? nullptr : open_log(request, files, scenario);

  files = {};  // they take memory
  RunReport report = report_of(scenario, request.file);
  report.with_step_digests = request.step_digests;
  if (stream) stream->start();
  run_within_memory(request, scenario, log.get(), stop, report);
  const bool bad_lines = stream && stream->stop() > 0;
  const bool is_written = finish(log.get(), report, err);
  print(report, request.json, out);
  if (page && is_written) {
    LogReader written(request.log_file);
    const std::string said = write_page(written, logged_scenario(written, {}), *page, std::nullopt);
    if (!request.json) out << "\n" << said;
  }

  const std::vector<std::string> broken = broken_plan_lines(report.run);
  for (const std::string& line : broken) err << "soda: plan broken: " << line << "\n";
  if (!is_written) return kExitFile;
  if (const std::uint32_t why = report.run.result.stopped; why != 0)
    return why == kStopForFailure ? kExitFile : kExitSignal + static_cast<int>(why);
  if (!broken.empty()) return kExitCheckFailed;
  return bad_lines ? kExitInput : kExitOk;
}

}  // namespace soda::analysis
