#include "analysis/runs/run_report.hpp"

#include <algorithm>

#include "analysis/process/stop_signals.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/runs/undivided_run.hpp"
#include "analysis/text/text_table.hpp"
#include "models/cost/joint_cost.hpp"
#include "models/world/event_kinds.hpp"
#include "physics/step/stages.hpp"

namespace soda::analysis {
namespace {

std::string heading_text(const RunReport& report) {
  const std::int64_t steps = report.run.result.committed_steps;
  std::string text = report.scenario + ": " + std::to_string(report.bodies) + " bodies, " +
                     std::to_string(report.worlds) +
                     (report.worlds == 1 ? " world, " : " worlds, ") + std::to_string(steps) +
                     " steps of " + format_number(report.dt_s) + " s; " +
                     name_of(report.options.executor) + " executor";
  if (report.options.executor == models::ExecutorKind::kThreads) {
    text += ", " + std::to_string(report.options.threads) + " threads, buffer of " +
            std::to_string(report.options.buffer) + " entries";
  }
  if (report.options.transport != nullptr) {
    text += ", " + std::to_string(report.options.transport->size()) + " ranks of " +
            std::to_string(report.options.threads) + " threads, buffer of " +
            std::to_string(report.options.buffer) + " entries";
  }
  if (report.run.result.cluster) {
    text += ", " + std::to_string(report.run.result.cluster->processors) +
            " processors, buffer of " + std::to_string(report.options.buffer) + " entries";
  }
  if (report.options.synchronisation == kernel::Synchronisation::kLockstep) text += ", lockstep";
  if (report.options.first_step > 0)
    text += ", from step " + std::to_string(report.options.first_step) + " on";
  text += "\n";
  if (const std::uint32_t why = report.run.result.stopped; why != 0)
    text += std::string("  ended early by ") + name_of_stop(why) + ", after step " +
            std::to_string(steps) + " of " + std::to_string(report.options.steps) + "\n";
  return text + "  digest of the state after the last step  " + format_digest(report.run.digest) +
         "\n";
}

std::string error_text(const RunReport& report) {
  const MeasuredRun& run = report.run;
  const ErrorMeasures& error = run.error;
  std::vector<std::vector<std::string>> rows = {
      {"energy drift", format_number(error.energy_drift_rel, 3), "of the energy scale", "wall time",
       format_number(run.cost.wall_s), "s"},
      {"momentum drift", format_number(error.momentum_drift_rel, 3), "of the momentum scale",
       "CPU time", format_number(run.cost.cpu_s), "s"},
      {"deepest penetration", format_number(error.max_penetration_m, 3), "m", "rate",
       format_number(steps_per_second(run)), "steps/s"},
      {"constraint residual", format_number(error.constraint_residual_m_s, 3), "m/s",
       "real-time factor", format_number(real_time_factor(run, report.dt_s)), ""},
      {"work of push-out", format_number(error.push_out_work_joule, 3), "J", "", "", ""},
  };
  if (run.result.stages.joint_rows > 0)
    rows.push_back({"joints off by", format_number(error.joint_error, 3), "m", "", "", ""});
  return format_table(
      {{"error"}, {"", Align::kRight}, {""}, {"run time"}, {"", Align::kRight}, {""}}, rows);
}

std::string events_text(const RunReport& report) {
  const kernel::Counters& events = report.run.result.events;
  const auto count = [](std::uint64_t value) { return std::to_string(value); };
  const std::vector<std::vector<std::string>> rows = {
      {"executed", count(events.executed), "committed", count(report.run.result.islands_committed),
       "mean", format_number(mean_lead_steps(events), 3) + " steps"},
      {"rolled back", count(events.rolled_back), "solved",
       count(report.run.result.stages.islands_solved), "largest",
       count(events.lead_max) + " steps"},
      {"committed", count(events.committed), "reused",
       count(report.run.result.worlds.islands_reused), "", ""},
      {"stragglers", count(events.stragglers), "at rest",
       count(report.run.result.stages.islands_at_rest), "", ""},
      {"anti-messages", count(events.anti_messages), "over budget",
       count(report.run.result.stages.islands_over_budget), "", ""},
      {"efficiency", format_number(100.0 * efficiency(events)) + " %", "", "", "", ""},
  };
  return format_table({{"events"},
                       {"", Align::kRight},
                       {"islands"},
                       {"", Align::kRight},
                       {"lead over GVT"},
                       {"", Align::kRight}},
                      rows);
}

// What kinds of events were undone and which messages came late; empty if nobody sent anything.
std::string kinds_text(const kernel::EventCounts& kinds) {
  const auto words = [](std::string name) {
    std::ranges::replace(name, '_', ' ');
    return name;
  };
  const auto count = [](std::uint64_t value) { return std::to_string(value); };
  std::vector<std::vector<std::string>> executions, messages;
  for (std::size_t kind = 0; kind < models::event_kinds().size(); ++kind) {
    const auto& [executed, rolled_back, committed] = kinds.executions[kind];
    if (executed > 0)
      executions.push_back(
          {words(models::event_kinds()[kind]), count(executed), count(rolled_back)});
  }
  for (std::size_t kind = 0; kind < models::message_kinds().size(); ++kind) {
    const auto& [sent, late, anti] = kinds.messages[kind];
    if (sent + late + anti > 0)
      messages.push_back(
          {words(models::message_kinds()[kind]), count(sent), count(late), count(anti)});
  }
  if (messages.empty()) return "";
  executions.resize(std::max(executions.size(), messages.size()), {"", "", ""});
  messages.resize(executions.size(), {"", "", "", ""});
  for (std::size_t i = 0; i < executions.size(); ++i)
    executions[i].insert(executions[i].end(), messages[i].begin(), messages[i].end());
  return format_table({{"event"},
                       {"executed", Align::kRight},
                       {"rolled back", Align::kRight},
                       {"message"},
                       {"sent", Align::kRight},
                       {"late", Align::kRight},
                       {"anti", Align::kRight}},
                      executions) +
         "\n";
}

// Empty if none is broken.
std::string broken_text(const RunReport& report) {
  constexpr std::size_t kMostIds = 20;
  const std::vector<std::uint32_t> broken = broken_joints(report.run.result);
  if (broken.empty()) return "";
  std::string text =
      std::to_string(broken.size()) + (broken.size() == 1 ? " joint broke: " : " joints broke: ");
  for (std::size_t i = 0; i < std::min(broken.size(), kMostIds); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(broken[i]);
  if (broken.size() > kMostIds)
    text += " and " + std::to_string(broken.size() - kMostIds) + " more (--json lists all)";
  return text + "\n\n";
}

// What the user could not expect is told line by line, up to a number that can be read.
std::string inputs_text(const RunReport& report) {
  constexpr std::size_t kMostLines = 20;
  const models::SimulationResult& result = report.run.result;
  if (!report.options.inputs.any()) return "";
  std::size_t moved = 0, without_effect = 0;
  std::vector<std::string> lines;
  for (const models::CommittedInput& committed : result.inputs) {
    const models::UserInput& input = committed.input;
    const bool was_late = committed.asked_step >= 0 && committed.asked_step < input.step;
    moved += was_late;
    without_effect += !committed.had_effect;
    if (!was_late && committed.had_effect) continue;
    std::string line = "  input " + std::to_string(input.id) + " (" + name_of(input.kind) +
                       " body " + std::to_string(report.labels[physics::index_of(input.body)]) +
                       ", step " + std::to_string(input.step) + ")";
    if (was_late) line += " came too late for step " + std::to_string(committed.asked_step);
    if (!committed.had_effect) line += std::string(was_late ? " and" : "") + " had no effect";
    lines.push_back(line + "\n");
  }
  std::string text = "user input: " + std::to_string(result.inputs.size()) + " acted, " +
                     std::to_string(without_effect) + " of them without effect, " +
                     std::to_string(moved) + " later than asked for; " +
                     std::to_string(result.inputs_too_late) + " after the last step\n";
  for (std::size_t i = 0; i < std::min(lines.size(), kMostLines); ++i) text += lines[i];
  if (lines.size() > kMostLines)
    text += "  and " + std::to_string(lines.size() - kMostLines) + " more (--json lists all)\n";
  return text + "\n";
}

// Empty if nobody could have gone back.
std::string entries_text(const models::WorldCounters& worlds) {
  if (worlds.bodies_stored == 0) return "";
  const auto each = [&worlds](std::uint64_t bytes) {
    return format_number(static_cast<double>(bytes) / static_cast<double>(worlds.bodies_stored), 3);
  };
  return "transform buffers: " + std::to_string(worlds.entries_stored) +
         " entries stored; bytes a body and entry: " + each(worlds.state_bytes_stored) +
         " (its state unshared: " + each(worlds.state_bytes_whole) + "), and " +
         each(worlds.memo_bytes_stored) + " for repetitions\n\n";
}

}  // namespace

std::vector<std::pair<std::string, std::int64_t>> account_terms(
    const kernel::TimeAccount& account) {
  return {{"useful", account.standing.useful_ns},
          {"replicated", account.standing.replicated_ns},
          {"division", account.standing.division_ns},
          {"checkpoints", account.standing.checkpoints_ns},
          {"gvt", account.gvt_ns},
          {"sending", account.standing.sending_ns},
          {"rolled_back", account.rolled_back_ns},
          {"bookkeeping", account.bookkeeping_ns},
          {"waiting", account.waiting_ns}};
}

std::string cluster_text(const kernel::VirtualReport& cluster,
                         std::optional<std::int64_t> one_processor_ns) {
  const auto milliseconds = [](std::int64_t ns) {
    return format_number(1e-6 * static_cast<double>(ns)) + " ms";
  };
  const std::optional<double> gain = speed_up(one_processor_ns, cluster);
  const std::vector<std::vector<std::string>> rows = {
      {"makespan", milliseconds(cluster.makespan_ns), "messages",
       std::to_string(cluster.remote_messages)},
      {"undivided, one processor", one_processor_ns ? milliseconds(*one_processor_ns) : "-",
       "bytes", std::to_string(cluster.remote_bytes)},
      {"speed-up", gain ? format_number(*gain) : "-", "barriers", std::to_string(cluster.barriers)},
      {"utilisation", format_number(100.0 * cluster_utilisation(cluster)) + " %", "most history",
       std::to_string(cluster.most_history) + " events"},
      {"execution digest", format_digest(cluster.execution_digest), "", ""},
  };
  return format_table({{"virtual cluster"}, {"", Align::kRight}, {"network"}, {"", Align::kRight}},
                      rows) +
         "\n" + account_text(cluster.account, "processors x makespan");
}

std::string account_text(const kernel::TimeAccount& account, const std::string& sum_name) {
  const auto row = [all_ns = account.sum_ns()](std::string name, std::int64_t ns) {
    std::ranges::replace(name, '_', ' ');
    const auto whole = static_cast<double>(std::max<std::int64_t>(all_ns, 1));
    return std::vector{name, format_number(1e-6 * static_cast<double>(ns)) + " ms",
                       format_number(100.0 * static_cast<double>(ns) / whole, 3)};
  };
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, ns] : account_terms(account)) rows.push_back(row(name, ns));
  rows.push_back(row(sum_name, account.sum_ns()));
  return format_table({{"processors' time"}, {"", Align::kRight}, {"%", Align::kRight}}, rows);
}

std::string account_line(const kernel::TimeAccount& account) {
  const auto whole = static_cast<double>(std::max<std::int64_t>(account.sum_ns(), 1));
  std::string line;
  for (auto [name, ns] : account_terms(account)) {
    std::ranges::replace(name, '_', ' ');
    line += (line.empty() ? "workers' time: " : ", ") + name + " " +
            format_number(100.0 * static_cast<double>(ns) / whole, 3);
  }
  return line + " %\n";
}

double cluster_utilisation(const kernel::VirtualReport& cluster) {
  if (cluster.makespan_ns == 0) return 0.0;
  return static_cast<double>(cluster.account.busy_ns()) /
         (static_cast<double>(cluster.makespan_ns) * cluster.processors);
}

double steps_per_second(const MeasuredRun& run) {
  return run.cost.wall_s > 0.0 ? static_cast<double>(run.steps) / run.cost.wall_s : 0.0;
}

double real_time_factor(const MeasuredRun& run, double dt_s) {
  return steps_per_second(run) * dt_s;
}

std::string plan_text(const std::vector<models::PlanLine>& plan,
                      const std::vector<std::uint64_t>* counters) {
  std::vector<Column> columns = {{"stage"}, {"needed"}};
  if (counters != nullptr) columns.push_back({"counted", Align::kRight});
  columns.push_back({"because"});
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    std::vector<std::string> row = {plan[i].stage, plan[i].needed ? "yes" : "no"};
    if (counters != nullptr) row.push_back(std::to_string((*counters)[i]));
    row.push_back(plan[i].reason);
    rows.push_back(row);
  }
  return format_table(columns, rows);
}

JointIslandFigures joint_island_figures(const physics::SceneDescription& scene) {
  JointIslandFigures figures;
  for (const models::JointCost& cost : models::joint_costs(scene)) {
    const auto& [bodies, joints, rows, multiplications] = cost.island;
    figures.counts.push_back(
        {{"first_body", scene.bodies[physics::index_of(bodies.front())].label},
         {"bodies", bodies.size()},
         {"joints", joints},
         {"rows", rows},
         {"multiplications", multiplications},
         {"swept", cost.swept},
         {"factorisations_us_per_step", static_cast<std::uint64_t>(cost.factors_ns / 1000)},
         {"percent_of_the_rest_of_a_step", static_cast<std::uint64_t>(100.0 * cost.of_the_rest)},
         {"costly", cost.is_costly()}});
    figures.words.push_back(models::words_for(scene, cost));
  }
  return figures;
}

std::string shape_pairs_text(const physics::SceneDescription& scene) {
  std::vector<std::vector<std::string>> rows;
  for (const physics::ShapePair& pair : physics::shape_pairs(scene))
    rows.push_back({pair.first + ", " + pair.second, physics::name_of(pair.kernel),
                    pair.by_fcl ? "FCL" : "own"});
  if (rows.empty()) return "";
  return "\n" + format_table({{"shapes that can meet"}, {"kernel"}, {"routine"}}, rows);
}

std::string joint_costs_text(const physics::SceneDescription& scene) {
  std::vector<models::JointCost> costs = models::joint_costs(scene);
  if (costs.empty()) return "";
  std::string text = "\n";
  for (std::size_t i = 0; i < costs.size() && (i == 0 || costs[i].is_costly()); ++i)
    text += std::string(costs[i].is_costly() ? "costly: " : "costliest: ") +
            models::words_for(scene, costs[i]) + "\n";
  return text;
}

RunReport report_of(const scenarios::Scenario& scenario, const std::string& file) {
  RunReport report;
  report.scenario = scenario.name;
  report.warnings = {file, scenario.warnings};
  report.bodies = scenario.initial.size();
  report.worlds = scenario.territory.worlds;
  report.dt_s = scenario.scene.dt_s;
  for (const physics::BodyParams& body : scenario.scene.bodies) report.labels.push_back(body.label);
  report.options = scenario.run;
  return report;
}

std::string run_text(const RunReport& report) {
  const std::optional<kernel::VirtualReport>& cluster = report.run.result.cluster;
  const std::optional<kernel::TimeAccount>& account = report.run.result.account;
  return heading_text(report) + "\n" +
         (report.real_time ? real_time_text(*report.real_time) + "\n" : "") + error_text(report) +
         "\n" + (report.run.estimates ? estimates_text(*report.run.estimates) + "\n" : "") +
         events_text(report) + "\n" + kinds_text(report.run.result.kinds) +
         entries_text(report.run.result.worlds) + (account ? account_line(*account) + "\n" : "") +
         (cluster ? cluster_text(*cluster, report.one_processor_ns) + "\n" : "") +
         inputs_text(report) + broken_text(report) +
         plan_text(report.run.plan, &report.run.plan_counters);
}

}  // namespace soda::analysis
