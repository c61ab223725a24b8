#include "analysis/commands/run_command.hpp"

#include <unistd.h>

#include <filesystem>
#include <memory>
#include <new>
#include <ostream>
#include <stdexcept>

#include "analysis/commands/json_output.hpp"
#include "analysis/commands/view_command.hpp"
#include "analysis/event_log/checkpoint.hpp"
#include "analysis/event_log/log_writer.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/measures/input_measures.hpp"
#include "analysis/process/installed.hpp"
#include "analysis/process/stop_signals.hpp"
#include "analysis/runs/input_stream.hpp"
#include "analysis/runs/run_report.hpp"
#include "analysis/runs/undivided_run.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/text/progress.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/text/version.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// A log must hold exactly what is run, so that is read once, here.
struct ScenarioFiles {
  std::string text;
  std::vector<scenarios::MeshFile> meshes;
};

// From where another run stood, with its options where the request gives none.
scenarios::Scenario load_again(RunRequest& request, ScenarioFiles& files, std::ostream& err) {
  LogReader log(request.resume);
  tell_flaws(log, request.resume, err);
  scenarios::Scenario scenario = resumed_scenario(log, log.last_states(), request.overrides);
  request.file = log.scenario().file;
  files = {log.scenario().text, log.meshes()};
  return scenario;
}

scenarios::Scenario load_with_files(RunRequest& request, ScenarioFiles& files, std::ostream& err) {
  if (!request.resume.empty()) return load_again(request, files, err);
  if (request.file.empty())
    throw UsageError("FILE is required, or --resume; soda examples lists scenes");
  request.file = installed(request.file);
  files.text = scenarios::read_text(request.file);
  scenarios::Scenario scenario =
      scenarios::read_scenario_text(files.text, request.file, request.overrides.seed,
                                    {.folder = "", .kept = nullptr, .read = &files.meshes});
  if (request.overrides.strict) refuse_warnings(request.file, scenario.warnings);
  apply_overrides(request.overrides, scenario.territory, scenario.run);
  return scenario;
}

std::int64_t checkpoint_every(const RunRequest& request) {
  constexpr std::int64_t kUsual = 1000;
  return request.checkpoint_every.value_or(kUsual);
}

LogLevel level_of(const RunRequest& request) {
  return request.log_level.value_or(LogLevel::kCommits);
}

LoggedOptions options_of_log(const RunRequest& request, const scenarios::Scenario& scenario) {
  const kernel::Transport* const job = request.overrides.transport;
  return {.overrides = request.overrides,
          .ranks = job == nullptr ? 0 : job->size(),
          .level = level_of(request),
          .every = request.log_every.value_or(1),
          .first_step = scenario.run.first_step};
}

// What a log, or a checkpoint, begins with.
struct LogHead {
  LoggedScenario scenario;
  LoggedOptions options;
  std::vector<std::uint32_t> labels;
};

LogHead head_of(const RunRequest& request, const ScenarioFiles& files,
                const scenarios::Scenario& scenario) {
  LogHead head{
      {kVersion, std::filesystem::absolute(request.file).string(), files.text, scenario.scene.dt_s},
      options_of_log(request, scenario),
      {}};
  for (const physics::BodyParams& body : scenario.scene.bodies) head.labels.push_back(body.label);
  return head;
}

std::unique_ptr<LogWriter> open_log(const RunRequest& request, const ScenarioFiles& files,
                                    const scenarios::Scenario& scenario) {
  if (request.log_file.empty()) return nullptr;
  refuse_own_input(request.log_file, request.file, "--log");
  refuse_own_input(request.log_file, request.resume, "--log");
  auto log = std::make_unique<LogWriter>(request.log_file, request.force);
  const LogHead head = head_of(request, files, scenario);
  log->begin(head.scenario, head.options, head.labels, files.meshes);
  const InputFollower start(scenario.scene, scenario.initial, scenario.run.inputs);
  const auto [ids, states] = start.bodies();
  models::CommittedStep first;
  first.step = scenario.run.first_step;
  first.ids = ids;
  first.states = states;
  first.inputs = scenario.run.inputs.acted;
  const bool written = log->add_committed(first);
  if (!written) log->finish();  // throws
  return log;
}

// A checkpoint may take the place of the one from which the run goes on.
std::unique_ptr<CheckpointWriter> open_checkpoints(const RunRequest& request,
                                                   const ScenarioFiles& files,
                                                   const scenarios::Scenario& scenario) {
  if (request.checkpoint_file.empty()) return nullptr;
  refuse_own_input(request.checkpoint_file, request.file, "--checkpoint");
  std::error_code none;
  const bool is_own = std::filesystem::equivalent(request.checkpoint_file, request.resume, none);
  LogHead head = head_of(request, files, scenario);
  return std::make_unique<CheckpointWriter>(
      request.checkpoint_file, checkpoint_every(request), request.force || is_own,
      CheckpointWriter::Run{std::move(head.scenario), head.options, std::move(head.labels),
                            files.meshes, scenario.run.inputs});
}

// A page has a log of its own, which has a trace, where no log is asked for.
bool wants_trace(const RunRequest& request) {
  if (request.log_file.empty()) return !request.view_file.empty();
  return level_of(request) == LogLevel::kTrace;
}

// What a run writes while it goes on; null: nothing.
struct RunFiles {
  std::unique_ptr<LogWriter> log;
  std::unique_ptr<CheckpointWriter> checkpoints;
};

// What is gathered for it on every rank.
models::CommitObserver observer_for(const RunRequest& request) {
  models::CommitObserver observer;
  const bool of_each_step = !request.log_file.empty() || !request.view_file.empty() ||
                            request.step_digests || request.real_time;
  observer.wants_states = of_each_step || !request.checkpoint_file.empty();
  if (!of_each_step) observer.states_every = checkpoint_every(request);
  observer.wants_trace = wants_trace(request);
  return observer;
}

void run_observed(const RunRequest& request, const scenarios::Scenario& scenario,
                  const RunFiles& files, kernel::StopRequest& stop, RunReport& report) {
  std::optional<RealTimeSession> session;
  if (request.real_time) session.emplace(*request.real_time, load_of(*request.real_time), scenario);
  models::CommitObserver observer = observer_for(request);
  if (observer.wants_states) {
    observer.on_step = [&](const models::CommittedStep& step) {
      if (session) session->add(step);
      if (request.step_digests)
        report.step_digests.push_back(physics::digest(step.ids, step.states));
      const bool written = !files.log || files.log->add_committed(step);
      const bool kept = !files.checkpoints || files.checkpoints->add(step);
      if (!written || !kept) stop.store(kStopForFailure);
    };
  }
  observer.on_trace = [&](std::span<const std::byte> chunk) {
    if (!files.log->add_trace(chunk)) stop.store(kStopForFailure);
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
  if (!request.log_file.empty() || !request.view_file.empty() || !request.checkpoint_file.empty())
    throw UsageError("--log, --checkpoint: what --rollback warm does cannot be had again");
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
                       const RunFiles& files, kernel::StopRequest& stop, RunReport& report) {
  const std::string what_for = asked_for(scenario);
  try {
    run_observed(request, scenario, files, stop, report);
  } catch (const std::bad_alloc&) {
    throw OutOfMemory(what_for);
  } catch (const std::length_error&) {
    throw OutOfMemory(what_for);
  } catch (const NumericalFailure&) {
    if (files.log) files.log->finish();  // what led there is of use
    throw;
  }
}

void print(const RunReport& report, bool as_json, std::ostream& out) {
  out << (as_json ? run_json(report) : run_text(report));
  if (as_json) return;
  for (std::size_t i = 0; i < report.step_digests.size(); ++i)
    out << "step " << report.options.first_step + static_cast<std::int64_t>(i) + 1 << " "
        << format_digest(report.step_digests[i]) << "\n";
}

// On a rank that is not the root.
int run_own_worlds(const RunRequest& request, const scenarios::Scenario& scenario) {
  std::optional<RealTimeSession> session;
  if (request.real_time) session.emplace(*request.real_time, load_of(*request.real_time), scenario);
  take_part(scenario.scene, scenario.initial, scenario.territory,
            session ? session->paced(scenario.run) : scenario.run, observer_for(request));
  return kExitOk;
}

// A last checkpoint; false if that, or writing one before, failed, which is told.
bool finish(CheckpointWriter* checkpoints, const RunReport& report, std::ostream& err) {
  if (checkpoints == nullptr || checkpoints->finish(report.run.result)) return true;
  err << "soda: " << checkpoints->failure() << "\n";
  return false;
}

// Closes the log; the same.
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
  if (!request.log_level) request.log_level = LogLevel::kTrace;  // the page has a timeline
  return page;
}

}  // namespace

int run_command(const RunRequest& given, std::ostream& out, std::ostream& err) {
  ScenarioFiles files;
  RunRequest request = given;
  scenarios::Scenario scenario = load_with_files(request, files, err);
  refuse_warm_where_bits_count(request);
  if (request.real_time) require_paceable(scenario.run);
  tell_warnings({{request.file, scenario.warnings}}, err);
  const std::unique_ptr<InputStream> stream = open_inputs(request.inputs, scenario, err);
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
  const RunFiles written{open_log(request, files, scenario),
                         open_checkpoints(request, files, scenario)};

  files = {};  // they take memory
  RunReport report = report_of(scenario, request.file);
  report.with_step_digests = request.step_digests;
  if (stream) stream->start();
  run_within_memory(request, scenario, written, stop, report);
  report.one_processor_ns =
      one_processor_ns(scenario.scene, scenario.initial, scenario.run, report.run.result);
  const bool bad_lines = stream && stream->stop() > 0;
  const bool is_logged = finish(written.log.get(), report, err);
  const bool is_kept = finish(written.checkpoints.get(), report, err);
  print(report, request.json, out);
  if (page && is_logged) {
    LogReader log(request.log_file);
    const std::string said = write_page(log, logged_scenario(log, {}), *page, std::nullopt);
    if (!request.json) out << "\n" << said;
  }

  const std::vector<std::string> broken = broken_plan_lines(report.run);
  for (const std::string& line : broken) err << "soda: plan broken: " << line << "\n";
  if (!is_logged || !is_kept) return kExitFile;
  if (const std::uint32_t why = report.run.result.stopped; why != 0)
    return why == kStopForFailure ? kExitFile : kExitSignal + static_cast<int>(why);
  if (!broken.empty()) return kExitCheckFailed;
  return bad_lines ? kExitInput : kExitOk;
}

}  // namespace soda::analysis
