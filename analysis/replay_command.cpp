#include "analysis/replay_command.hpp"

#include <algorithm>
#include <exception>
#include <ostream>

#include "analysis/exit_codes.hpp"
#include "analysis/input_measures.hpp"
#include "analysis/json_output.hpp"
#include "analysis/log_reader.hpp"
#include "analysis/logged_run.hpp"
#include "analysis/measured_run.hpp"
#include "analysis/progress.hpp"
#include "analysis/run_report.hpp"
#include "analysis/step_comparison.hpp"
#include "analysis/stop_signals.hpp"
#include "analysis/text_table.hpp"
#include "analysis/trace/recorded_order.hpp"
#include "analysis/warnings.hpp"

namespace soda::analysis {
namespace {

std::vector<std::string> state_row(std::uint32_t label, const physics::BodyState& state) {
  std::vector<std::string> row = {std::to_string(label)};
  const auto add = [&row](double number) { row.push_back(format_number(number, 9)); };
  for (int i = 0; i < 3; ++i) add(state.position_m[i]);
  add(state.orientation.w());
  add(state.orientation.x());
  add(state.orientation.y());
  add(state.orientation.z());
  for (int i = 0; i < 3; ++i) add(state.linear_velocity_m_s[i]);
  for (int i = 0; i < 3; ++i) add(state.angular_velocity_rad_s[i]);
  row.push_back(std::to_string(state.impulses.size()));
  return row;
}

std::string states_text(const LoggedStep& logged, const std::vector<std::uint32_t>& labels) {
  std::vector<Column> columns;
  for (const char* title : {"body", "x m", "y m", "z m", "qw", "qx", "qy", "qz", "vx m/s", "vy m/s",
                            "vz m/s", "wx rad/s", "wy rad/s", "wz rad/s", "impulses"}) {
    columns.push_back({title, Align::kRight});
  }
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < logged.ids.size(); ++i) {
    rows.push_back(state_row(labels[physics::index_of(logged.ids[i])], logged.states[i]));
  }
  return format_table(columns, rows);
}

// One body in full: every value exact, with its bits.
std::string body_text(const physics::BodyState& state) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&rows](const std::string& name, double number) {
    rows.push_back({name, format_exact(number), format_bits(number)});
  };
  const auto add_vec3 = [&add](const std::string& name, const physics::Vec3& v) {
    add(name + ".x", v.x());
    add(name + ".y", v.y());
    add(name + ".z", v.z());
  };
  add_vec3("position_m", state.position_m);
  add("orientation.w", state.orientation.w());
  add("orientation.x", state.orientation.x());
  add("orientation.y", state.orientation.y());
  add("orientation.z", state.orientation.z());
  add_vec3("linear_velocity_m_s", state.linear_velocity_m_s);
  add_vec3("angular_velocity_rad_s", state.angular_velocity_rad_s);
  for (std::size_t i = 0; i < state.impulses.size(); ++i) {
    const std::string name = "impulses[" + std::to_string(i) + "].";
    add(name + "normal_newton_s", state.impulses[i].normal_newton_s);
    add_vec3(name + "friction_newton_s", state.impulses[i].friction_newton_s);
  }
  return format_table({{"field"}, {"value", Align::kRight}, {"bits"}}, rows);
}

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
    const auto found = std::find(labels.begin(), labels.end(), *request.body);
    if (found == labels.end()) {
      throw UsageError("--body: " + request.file + " has no body " + std::to_string(*request.body));
    }
    const auto body = static_cast<physics::BodyId>(found - labels.begin());
    const auto place = std::lower_bound(logged.ids.begin(), logged.ids.end(), body);
    const bool is_there = place != logged.ids.end() && *place == body;
    text += ", body " + std::to_string(*request.body);
    text += is_there
                ? "\n\n" +
                      body_text(logged.states[static_cast<std::size_t>(place - logged.ids.begin())])
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

// Of a virtual cluster that did the same work another way, though it was to be the same.
std::optional<std::string> execution_divergence(const ReplayRequest& request, const LogReader& log,
                                                const MeasuredRun& run) {
  const std::optional<std::uint64_t> logged = log.execution_digest();
  const bool adds_nothing = encode(LoggedOptions{request.overrides}) == encode(LoggedOptions{});
  const bool is_comparable = logged && run.result.cluster && adds_nothing;
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
  kernel::RecordedOrder order;
  std::vector<kernel::Bytes> chunks;
  if (request.as_executed) {
    order = recorded_order(log, scenario);
    scenario.run.recorded = &order;
    scenario.run.recorded_over_ranks = log.options().ranks > 1;
    observer.wants_trace = true;
    observer.on_trace = [&chunks](std::span<const std::byte> chunk) {
      chunks.emplace_back(chunk.begin(), chunk.end());
    };
  }
  observer.wants_states = true;
  observer.on_step = [&](const models::CommittedStep& step) {
    comparison.compare(step.step, step.ids, step.states);
  };
  try {
    report.run = measure_run(scenario.scene, scenario.initial, scenario.territory, scenario.run,
                             observer, terminal_progress(scenario.run.steps, request.quiet));
  } catch (const kernel::NotAsRecorded& fault) {
    err << "soda: " << request.file << ": divergence: " << fault.what() << "\n";
    return kExitCheckFailed;
  }
  if (comparison.error) std::rethrow_exception(comparison.error);
  report.replay->divergence = comparison.first_difference;
  if (!comparison.first_difference)
    report.replay->divergence = request.as_executed
                                    ? trace_divergence(log, report.worlds, chunks)
                                    : execution_divergence(request, log, report.run);
  return tell(request, report, out, err);
}

}  // namespace

int replay_command(const ReplayRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  const int outcome = request.step ? show_state(request, log, out) : rerun(request, log, out, err);
  return log.damage().empty() ? outcome : kExitCheckFailed;
}

}  // namespace soda::analysis
