#include "analysis/commands/replay_command.hpp"

#include <algorithm>
#include <exception>
#include <ostream>

#include "analysis/commands/json_output.hpp"
#include "analysis/commands/replay_session.hpp"
#include "analysis/commands/replay_until.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/event_log/state_text.hpp"
#include "analysis/event_log/step_comparison.hpp"
#include "analysis/measures/input_measures.hpp"
#include "analysis/process/stop_signals.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/run_report.hpp"
#include "analysis/runs/undivided_run.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/progress.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/trace/recorded_order.hpp"

namespace soda::analysis {
namespace {

int show_state(const ReplayRequest& request, LogReader& log, std::ostream& out) {
  if (*request.step < log.first_step() || *request.step > log.last_step()) {
    throw UsageError("--step: found " + std::to_string(*request.step) +
                     "; allowed: " + std::to_string(log.first_step()) + " to " +
                     std::to_string(log.last_step()) + ", the last whole step of " + request.file);
  }
  const std::vector<std::uint32_t>& labels = log.labels();
  const LoggedStep logged = log.read_states(*request.step);
  std::string text =
      "step " + std::to_string(logged.step) + ", digest " + format_digest(logged.digest);
  if (request.body) {
    const physics::BodyId body = body_of_label(labels, *request.body, "--body: " + request.file);
    const auto place = std::lower_bound(logged.ids.begin(), logged.ids.end(), body);
    const bool is_there = place != logged.ids.end() && *place == body;
    text += ", body " + std::to_string(*request.body);
    text += is_there
                ? "\n\n" + state_in_full(
                               logged.states[static_cast<std::size_t>(place - logged.ids.begin())])
                : ": not there\n";
  } else {
    text += "\n\n" + states_text(logged, labels);
  }
  out << text;
  return kExitOk;
}

// Remembers the first difference, and ends the run there. Called from worker threads: what reading
// the log again throws is thrown when the run has ended.
struct Comparison {
  LogReader& log;
  kernel::StopRequest& stop;
  std::optional<std::string> first_difference;
  std::exception_ptr error;

  void compare(std::int64_t step, std::span<const physics::BodyId> ids,
               std::span<const physics::BodyState> states) {
    if (stop.load() != 0) return;
    try {
      const std::string found = divergence(log.read_step(step), ids, states, log.labels());
      if (found.empty()) return;
      first_difference = found;
    } catch (const std::exception&) {
      error = std::current_exception();
    }
    stop.store(kStopForFailure);
  }
};

// Whether it is to be run just as it was.
bool adds_nothing(const ReplayRequest& request) {
  LoggedOptions added{request.overrides};
  added.overrides.strict = false;
  return encode(added) == encode(LoggedOptions{});
}

// Of a virtual cluster that did the same work another way, though it was to be the same.
std::optional<std::string> execution_divergence(const ReplayRequest& request, const LogReader& log,
                                                const MeasuredRun& run) {
  const std::optional<std::uint64_t> logged = log.execution_digest();
  const bool is_comparable = logged && run.result.cluster && adds_nothing(request);
  if (!is_comparable || *logged == run.result.cluster->execution_digest) return std::nullopt;
  return "the end: execution digest " + format_digest(run.result.cluster->execution_digest) +
         ", logged " + format_digest(*logged);
}

int tell(const ReplayRequest& request, const RunReport& report, std::ostream& out,
         std::ostream& err) {
  if (request.json) out << run_json(report);
  if (report.replay->divergence) {
    err << "soda: " << request.file << ": divergence at " << *report.replay->divergence << "\n";
    return kExitCheckFailed;
  }
  if (!request.json)
    out << request.file << ": " << report.run.result.committed_steps
        << " steps replayed without divergence; " << name_of(report.options.executor)
        << " executor, " << report.worlds << " worlds, digest " << format_digest(report.run.digest)
        << "\n";
  return kExitOk;
}

int rerun(const ReplayRequest& request, LogReader& log, std::ostream& out, std::ostream& err) {
  scenarios::Scenario scenario = logged_scenario(log, request.overrides);
  tell_warnings({{log.scenario().file, scenario.warnings}}, err);
  kernel::StopRequest stop{0};
  scenario.run.stop = &stop;
  Comparison comparison{log, stop, {}, {}};
  RunReport report = report_of(scenario, log.scenario().file);
  report.replay = {request.file, std::nullopt};
  const models::InputOptions& inputs = scenario.run.inputs;
  const InputFollower start(scenario.scene, scenario.initial, inputs);
  comparison.compare(log.first_step(), start.bodies().ids, start.bodies().states);
  if (comparison.first_difference) {
    report.replay->divergence = comparison.first_difference;
    return tell(request, report, out, err);
  }
  models::CommitObserver observer;
  models::RecordedExecution execution;
  std::vector<kernel::Bytes> chunks;
  if (request.as_executed) {
    execution = recorded_execution(log, scenario);
    scenario.run.recorded = &execution;
    observer.wants_trace = true;
    observer.on_trace = [&chunks](std::span<const std::byte> chunk) {
      chunks.emplace_back(chunk.begin(), chunk.end());
    };
  }
  observer.wants_states = true;
  observer.on_step = [&](const models::CommittedStep& step) {
    comparison.compare(step.step, step.ids, step.states);
  };
  report.run = measure_run(scenario.scene, scenario.initial, scenario.territory, scenario.run,
                           observer, terminal_progress(scenario.run.steps, request.quiet));
  if (comparison.error) std::rethrow_exception(comparison.error);
  report.replay->divergence = comparison.first_difference;
  if (!comparison.first_difference)
    report.replay->divergence = request.as_executed
                                    ? trace_divergence(log, report.worlds, chunks)
                                    : execution_divergence(request, log, report.run);
  if (request.json)
    report.one_processor_ns =
        one_processor_ns(scenario.scene, scenario.initial, scenario.run, report.run.result);
  return tell(request, report, out, err);
}

bool stops_at_an_event(const ReplayRequest& request) {
  return !request.until.empty() || !request.break_before.empty();
}

void refuse_what_does_not_go_together(const ReplayRequest& request) {
  const bool stops = stops_at_an_event(request);
  if (request.body && !request.step && !stops)
    throw UsageError("--body: needs --step, --until or --break");
  // What walks through a recorded run has nothing to say about how it is run.
  if ((stops || request.interactive) && !adds_nothing(request))
    throw UsageError(
        "--until, --break and --interactive are for the run as it was: no other option of it can "
        "be given");
}

int carry_out(const ReplayRequest& request, LogReader& log, std::ostream& out, std::ostream& err) {
  if (request.interactive) return replay_session(request, log, out, err);
  if (request.step) return show_state(request, log, out);
  try {
    return stops_at_an_event(request) ? replay_until(request, log, out)
                                      : rerun(request, log, out, err);
  } catch (const kernel::NotAsRecorded& fault) {
    err << "soda: " << request.file << ": divergence: " << fault.what() << "\n";
    return kExitCheckFailed;
  }
}

}  // namespace

int replay_command(const ReplayRequest& request, std::ostream& out, std::ostream& err) {
  refuse_what_does_not_go_together(request);
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  const int outcome = carry_out(request, log, out, err);
  return log.damage().empty() ? outcome : kExitCheckFailed;
}

}  // namespace soda::analysis
