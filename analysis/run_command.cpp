#include "analysis/run_command.hpp"

#include <filesystem>
#include <memory>
#include <ostream>

#include "analysis/exit_codes.hpp"
#include "analysis/input_measures.hpp"
#include "analysis/input_stream.hpp"
#include "analysis/json_output.hpp"
#include "analysis/log_writer.hpp"
#include "analysis/progress.hpp"
#include "analysis/run_report.hpp"
#include "analysis/text_table.hpp"
#include "analysis/version.hpp"
#include "analysis/warnings.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// A log must hold exactly the text that is run, so the text is read once, here.
scenarios::Scenario load_with_text(const RunRequest& request, std::string& text) {
  text = read_whole_file(request.file);
  scenarios::Scenario scenario =
      scenarios::read_scenario_text(text, request.file, request.overrides.seed);
  if (request.overrides.strict) refuse_warnings(request.file, scenario.warnings);
  apply_overrides(request.overrides, scenario.territory, scenario.run);
  return scenario;
}

std::unique_ptr<LogWriter> open_log(const RunRequest& request, const std::string& text,
                                    const scenarios::Scenario& scenario) {
  std::vector<std::uint32_t> labels;
  for (const physics::BodyParams& body : scenario.scene.bodies) labels.push_back(body.label);
  auto log = std::make_unique<LogWriter>(request.log_file);
  log->begin({kVersion, std::filesystem::absolute(request.file).string(), text}, request.overrides,
             labels);
  const InputFollower start(scenario.scene, scenario.initial, scenario.run.inputs);
  const auto [ids, states] = start.bodies();
  log->add_step({.step = 0,
                 .digest = physics::digest(ids, states),
                 .ids = {ids.begin(), ids.end()},
                 .states = {states.begin(), states.end()},
                 .inputs = {},
                 .territory_changes = {}});
  return log;
}

MeasuredRun run_observed(const RunRequest& request, const scenarios::Scenario& scenario,
                         LogWriter* log, std::vector<std::uint64_t>& step_digests,
                         std::optional<RealTimeReport>& real_time) {
  std::optional<RealTimeSession> session;
  if (request.real_time) session.emplace(*request.real_time, scenario);
  models::CommitObserver observer;
  observer.wants_states = log != nullptr || request.step_digests || session;
  if (observer.wants_states) {
    observer.on_step = [&](const models::CommittedStep& step) {
      if (session) session->add(step);
      if (log == nullptr && !request.step_digests) return;
      const std::uint64_t digest = physics::digest(step.ids, step.states);
      if (request.step_digests) step_digests.push_back(digest);
      if (log != nullptr)
        log->add_step(
            {.step = step.step,
             .digest = digest,
             .ids = {step.ids.begin(), step.ids.end()},
             .states = {step.states.begin(), step.states.end()},
             .inputs = {step.inputs.begin(), step.inputs.end()},
             .territory_changes = {step.territory_changes.begin(), step.territory_changes.end()}});
    };
  }
  if (session) session->start();
  MeasuredRun run = measure_run(scenario.scene, scenario.initial, scenario.territory,
                                session ? session->paced(scenario.run) : scenario.run, observer,
                                terminal_progress(scenario.run.steps, request.quiet));
  if (session) real_time = session->finish();
  return run;
}

// A warm rollback's bits depend on when messages came.
void refuse_warm_where_bits_count(const RunRequest& request) {
  if (request.overrides.rollback != models::RollbackMode::kWarm) return;
  if (!request.log_file.empty()) throw UsageError("--log: what --rollback warm does has no replay");
  if (request.overrides.cluster.check_purity)
    throw UsageError("--check-purity: --rollback warm is not pure");
}

}  // namespace

int run_command(const RunRequest& given, std::ostream& out, std::ostream& err) {
  std::string text;
  scenarios::Scenario scenario = load_with_text(given, text);
  refuse_warm_where_bits_count(given);
  if (given.real_time) require_paceable(scenario.run);
  tell_warnings({{given.file, scenario.warnings}}, err);
  const std::unique_ptr<InputStream> stream = open_inputs(given.inputs, scenario, err);
  RunRequest request = given;
  if (request.log_file.empty()) request.log_file = scenario.output.log_file;
  request.step_digests = request.step_digests || scenario.output.step_digests;
  if (request.overrides.transport != nullptr && !request.overrides.transport->is_root()) {
    models::CommitObserver observer;
    observer.wants_states = !request.log_file.empty() || request.step_digests;
    take_part(scenario.scene, scenario.initial, scenario.territory, scenario.run, observer);
    return kExitOk;
  }
  const std::unique_ptr<LogWriter> log =
      request.log_file.empty() ? nullptr : open_log(request, text, scenario);

  RunReport report;
  if (stream) stream->start();
  report.run = run_observed(request, scenario, log.get(), report.step_digests, report.real_time);
  const bool bad_lines = stream && stream->stop() > 0;
  if (log) log->finish(report.run.result.committed_steps, report.run.digest);

  report.scenario = scenario.name;
  report.warnings = {given.file, scenario.warnings};
  report.bodies = scenario.initial.size();
  report.worlds = scenario.territory.worlds;
  report.dt_s = scenario.scene.dt_s;
  for (const physics::BodyParams& body : scenario.scene.bodies) report.labels.push_back(body.label);
  report.options = scenario.run;
  report.with_step_digests = request.step_digests;
  out << (request.json ? run_json(report) : run_text(report));
  if (!request.json) {
    for (std::size_t i = 0; i < report.step_digests.size(); ++i) {
      out << "step " << i + 1 << " " << format_digest(report.step_digests[i]) << "\n";
    }
  }

  const std::vector<std::string> broken = broken_plan_lines(report.run);
  for (const std::string& line : broken) err << "soda: plan broken: " << line << "\n";
  if (!broken.empty()) return kExitCheckFailed;
  return bad_lines ? kExitInput : kExitOk;
}

}  // namespace soda::analysis
