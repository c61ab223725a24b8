#include "analysis/commands/compare_command.hpp"

#include <algorithm>
#include <functional>
#include <ostream>

#include "analysis/commands/search_json.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/json_text.hpp"
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

void compare(const ExactStep& exact, const models::CommittedStep& found,
             SettingMeasures& found_in) {
  if (physics::digest(found.ids, found.states) == exact.digest) return;
  if (!found_in.first_different_step) found_in.first_different_step = found.step;
  // Who is there is decided by user input alone, so the lists are the same.
  for (std::size_t i = 0; i < std::min(found.ids.size(), exact.ids.size()); ++i) {
    const BodyState& state = found.states[i];
    found_in.position_deviation_m =
        std::max(found_in.position_deviation_m, (state.position_m - exact.positions_m[i]).norm());
    found_in.velocity_deviation_m_s =
        std::max(found_in.velocity_deviation_m_s,
                 (state.linear_velocity_m_s - exact.velocities_m_s[i]).norm());
  }
}

struct Setting {
  std::string name;
  std::function<void(models::RunOptions&)> apply;
};

template <class Value>
std::vector<Setting> settings_of(Value models::RunOptions::*member, std::vector<Value> values) {
  std::vector<Setting> settings;
  settings.reserve(values.size());
  for (const Value value : values)
    settings.push_back({name_of(value),
                        [member, value](models::RunOptions& options) { options.*member = value; }});
  return settings;
}

std::vector<Setting> switched(bool models::RunOptions::*member) {
  std::vector<Setting> settings;
  for (const bool on : {true, false})
    settings.push_back(
        {on ? "on" : "off", [member, on](models::RunOptions& options) { options.*member = on; }});
  return settings;
}

std::vector<Setting> settings_of(Aspect aspect) {
  using models::BalancingPolicy, models::GhostMode, models::RollbackMode;
  switch (aspect) {
    case Aspect::kRollback:
      return settings_of(
          &models::RunOptions::rollback,
          std::vector{RollbackMode::kPropagate, RollbackMode::kInvalidate, RollbackMode::kWarm});
    case Aspect::kGating:
      return switched(&models::RunOptions::gating);
    case Aspect::kGhosts:
      return settings_of(
          &models::RunOptions::ghosts,
          std::vector{GhostMode::kReceivedOnly, GhostMode::kDeadReckoning, GhostMode::kPredicted});
    case Aspect::kBalancing: {
      std::vector<Setting> settings;
      for (const BalancingPolicy policy : {BalancingPolicy::kOff, BalancingPolicy::kPaper})
        settings.push_back({name_of(policy), [policy](models::RunOptions& options) {
                              options.balancing.policy = policy;
                            }});
      return settings;
    }
    case Aspect::kIslands:
      return switched(&models::RunOptions::split_islands);
  }
  return {};
}

SettingMeasures measure(const scenarios::Scenario& scenario, const std::vector<ExactStep>& exact,
                        const Setting& setting) {
  SettingMeasures measures;
  measures.setting = setting.name;
  models::RunOptions options = scenario.run;
  setting.apply(options);
  const models::CommitObserver observer{
      .wants_states = true, .on_step = [&](const models::CommittedStep& step) {
        compare(exact[static_cast<std::size_t>(step.step - 1)], step, measures);
      }};
  const MeasuredRun run =
      measure_run(scenario.scene, scenario.initial, scenario.territory, options, observer, {});
  const models::SimulationResult& result = run.result;
  measures.rollbacks = result.events.rollbacks;
  measures.steps_repeated = result.worlds.steps_repeated;
  measures.islands_solved = result.stages.islands_solved;
  measures.islands_wasted = result.stages.islands_advanced() - result.islands_committed;
  measures.islands_warm = result.worlds.islands_warm;
  measures.iterations = result.stages.solver_iterations;
  measures.contacts_false = result.worlds.contacts_false;
  measures.contacts_missed = result.worlds.contacts_missed;
  measures.ghosts_guessed = result.worlds.ghosts_answered;
  measures.ghosts_confirmed = result.worlds.ghosts_confirmed;
  measures.cells_transferred = result.territory_changes.size();
  measures.makespan_s = 1e-9 * static_cast<double>(result.cluster->makespan_ns);
  return measures;
}

// A column that is 0 in every row of a table is left out of text, not of CSV and JSON.
struct MeasureColumn {
  const char* title;
  const char* key;
  double (*value)(const SettingMeasures&);
};

template <auto Member>
double number(const SettingMeasures& measures) {
  return static_cast<double>(measures.*Member);
}

constexpr MeasureColumn kMeasureColumns[] = {
    {"rollbacks", "rollbacks", number<&SettingMeasures::rollbacks>},
    {"steps again", "steps_repeated", number<&SettingMeasures::steps_repeated>},
    {"solves", "islands_solved", number<&SettingMeasures::islands_solved>},
    {"wasted", "islands_wasted", number<&SettingMeasures::islands_wasted>},
    {"warm", "islands_warm", number<&SettingMeasures::islands_warm>},
    {"iterations", "iterations", number<&SettingMeasures::iterations>},
    {"false contacts", "contacts_false", number<&SettingMeasures::contacts_false>},
    {"missed", "contacts_missed", number<&SettingMeasures::contacts_missed>},
    {"guessed", "ghosts_guessed", number<&SettingMeasures::ghosts_guessed>},
    {"right", "ghosts_confirmed", number<&SettingMeasures::ghosts_confirmed>},
    {"cells moved", "cells_transferred", number<&SettingMeasures::cells_transferred>},
    {"makespan s", "makespan_s", number<&SettingMeasures::makespan_s>},
    {"first different step", "first_different_step",
     [](const SettingMeasures& measures) {
       return static_cast<double>(measures.first_different_step.value_or(0));
     }},
    {"off by m", "position_deviation_m", number<&SettingMeasures::position_deviation_m>},
    {"m/s", "velocity_deviation_m_s", number<&SettingMeasures::velocity_deviation_m_s>},
};

std::string table_of(const AspectMeasures& aspect) {
  std::vector<Column> columns = {{name_of(aspect.aspect)}};
  std::vector<std::vector<std::string>> rows;
  for (const SettingMeasures& measures : aspect.settings) rows.push_back({measures.setting});
  for (const MeasureColumn& column : kMeasureColumns) {
    const auto is_there = [&](const SettingMeasures& of) { return column.value(of) != 0.0; };
    if (std::ranges::none_of(aspect.settings, is_there)) continue;
    columns.push_back({column.title, Align::kRight});
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double value = column.value(aspect.settings[i]);
      rows[i].push_back(value == 0.0 ? "-" : format_number(value, 6));
    }
  }
  return format_table(columns, rows);
}

std::string compare_text(const CompareReport& report) {
  std::string text = report.scenario + ", " + std::to_string(report.steps) + " steps, " +
                     std::to_string(report.worlds) + " worlds on the virtual cluster\n";
  for (const AspectMeasures& aspect : report.aspects) text += "\n" + table_of(aspect);
  return text;
}

std::string compare_csv(const CompareReport& report) {
  std::string text = "aspect,setting";
  for (const MeasureColumn& column : kMeasureColumns) text += std::string(",") + column.key;
  for (const AspectMeasures& aspect : report.aspects)
    for (const SettingMeasures& measures : aspect.settings) {
      text += std::string("\n") + name_of(aspect.aspect) + "," + measures.setting;
      for (const MeasureColumn& column : kMeasureColumns)
        text += "," + format_exact(column.value(measures));
    }
  return text + "\n";
}

std::string compare_json(const CompareReport& report) {
  JsonObject aspects, json;
  for (const AspectMeasures& aspect : report.aspects)
    aspects.set(name_of(aspect.aspect),
                list_of(aspect.settings, [](const SettingMeasures& measures) {
                  JsonObject line;
                  line.set("setting", quoted(measures.setting));
                  for (const MeasureColumn& column : kMeasureColumns)
                    line.set(column.key, json_of(column.value(measures)));
                  const auto& step = measures.first_different_step;
                  return line.set("first_different_step", step ? json_of(*step) : "null").text();
                }));
  return json.set("scenario", quoted(report.scenario))
             .set("steps", json_of(report.steps))
             .set("worlds", json_of(report.worlds))
             .set("warnings", warnings_list({report.warnings}))
             .set("aspects", aspects.text())
             .text() +
         "\n";
}

constexpr Aspect kAspects[] = {Aspect::kRollback, Aspect::kGating, Aspect::kGhosts,
                               Aspect::kBalancing, Aspect::kIslands};

std::vector<Aspect> aspects_of(const std::vector<std::string>& names) {
  std::vector<Aspect> aspects;
  for (const Aspect aspect : kAspects)
    if (names.empty() || std::ranges::find(names, name_of(aspect)) != names.end())
      aspects.push_back(aspect);
  return aspects;
}

}  // namespace

const char* name_of(Aspect aspect) {
  constexpr const char* kNames[] = {"rollback", "gating", "ghosts", "balancing", "islands"};
  return kNames[static_cast<int>(aspect)];
}

CompareReport compare_settings(const CompareRequest& request) {
  scenarios::Scenario scenario = load_scenario(request.file, request.overrides);
  scenario.run.executor = models::ExecutorKind::kVirtual;
  CompareReport report{scenario.name,
                       scenario.run.steps,
                       scenario.territory.worlds,
                       {},
                       {request.file, scenario.warnings}};
  const std::vector<ExactStep> exact = exact_steps(scenario);
  for (const Aspect aspect : aspects_of(request.over)) {
    AspectMeasures measures{aspect, {}};
    for (const Setting& setting : settings_of(aspect))
      measures.settings.push_back(measure(scenario, exact, setting));
    report.aspects.push_back(std::move(measures));
  }
  return report;
}

// Only a warm rollback may change bits.
int compare_command(const CompareRequest& request, std::ostream& out, std::ostream& err) {
  const CompareReport report = compare_settings(request);
  tell_warnings({report.warnings}, err);
  out << (request.json  ? compare_json(report)
          : request.csv ? compare_csv(report)
                        : compare_text(report));
  for (const AspectMeasures& aspect : report.aspects)
    for (const SettingMeasures& measures : aspect.settings) {
      if (!measures.first_different_step ||
          measures.setting == name_of(models::RollbackMode::kWarm))
        continue;
      err << "soda: " << name_of(aspect.aspect) << " " << measures.setting
          << " ended with other bits than the sequential run\n";
      return kExitCheckFailed;
    }
  return kExitOk;
}

}  // namespace soda::analysis
