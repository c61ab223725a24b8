#include "analysis/commands/log_command.hpp"

#include <algorithm>
#include <ostream>
#include <utility>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/measures/input_measures.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/trace/trace_records.hpp"
#include "analysis/trace/trace_words.hpp"
#include "analysis/trace/world_steps.hpp"
#include "analysis/viewer/vtk_files.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"
#include "models/world/event_kinds.hpp"

namespace soda::analysis {
namespace {

// Lines of equal fields, each value as JSON text, in one of two forms.
class Lines {
 public:
  Lines(std::ostream& out, bool csv) : out_(out), csv_(csv) {}

  void add(const JsonObject& line) {
    if (csv_) return add_csv(line);
    out_ << (is_first_ ? "[\n  " : ",\n  ") << line.text();
    is_first_ = false;
  }
  void finish() {
    if (!csv_) out_ << (is_first_ ? "[]\n" : "\n]\n");
  }

 private:
  void add_csv(const JsonObject& line) {
    const auto row = [this, &line](auto value_of) {
      for (std::size_t i = 0; i < line.fields.size(); ++i)
        out_ << (i == 0 ? "" : ",") << value_of(line.fields[i]);
      out_ << "\n";
    };
    if (is_first_) row([](const auto& field) { return field.first; });
    is_first_ = false;
    row([](const auto& field) { return field.second == "null" ? std::string() : field.second; });
  }

  std::ostream& out_;
  const bool csv_;
  bool is_first_ = true;
};

void add_steps(LogReader& log, Lines& lines) {
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step) {
    const LoggedStep logged = log.read_step(step);
    lines.add(JsonObject()
                  .set("step", json_of(step))
                  .set("digest", quoted(format_digest(logged.digest)))
                  .set("bodies", logged.has_states ? json_of(logged.ids.size()) : "null")
                  .set("inputs", json_of(logged.inputs.size()))
                  .set("cells_given_away", json_of(logged.territory_changes.size())));
  }
}

bool is_due(const LogReader& log, std::int64_t step, const std::optional<std::int64_t>& every) {
  return has_states(log.options(), step) &&
         (!every || (step - log.first_step()) % *every == 0 || step == log.last_states());
}

// Where a body is, and whose it is.
struct StatePlace {
  std::int64_t step = 0;
  double time_s = 0.0;
  std::uint32_t label = 0, island = 0;
  std::optional<models::WorldId> world;  // none: it is no number where it is
};

JsonObject state_line(const StatePlace& place, const physics::BodyState& state) {
  JsonObject line;
  line.set("step", json_of(place.step))
      .set("time_s", json_of(place.time_s))
      .set("body", json_of(place.label))
      .set("world", place.world ? json_of(models::index_of(*place.world)) : "null")
      .set("island", json_of(place.island));
  const auto add = [&line](const std::string& name, const auto& vector, const std::string& unit) {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis)
      line.set((name + kAxes[axis]).append(unit), finite_or_null(vector[axis]));
  };
  add("", state.position_m, "_m");
  line.set("qw", finite_or_null(state.orientation.w()));
  add("q", state.orientation.vec(), "");
  add("v", state.linear_velocity_m_s, "_m_s");
  add("w", state.angular_velocity_rad_s, "_rad_s");
  return line;
}

void check_labels(const LogReader& log, const std::vector<std::uint32_t>& wanted) {
  for (const std::uint32_t label : wanted)
    if (std::ranges::find(log.labels(), label) == log.labels().end())
      throw UsageError("--body: " + log.file() + " has no body " + std::to_string(label));
}

void add_states(LogReader& log, const LogRequest& request, Lines& lines) {
  log.last_states();  // there are some
  check_labels(log, request.bodies);
  const scenarios::Scenario scenario = logged_scenario(log, {});
  models::TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scenario.scene);
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step) {
    const LoggedStep logged = log.read_step(step);
    follow_changes(logged, map);
    if (!is_due(log, step, request.every)) continue;
    const std::vector<std::uint32_t> islands = islands_of(logged, scenario.scene);
    const auto label_of = [&](std::size_t i) {
      return log.labels()[physics::index_of(logged.ids[i])];
    };
    for (std::size_t i = 0; i < logged.ids.size(); ++i) {
      const physics::BodyState& state = logged.states[i];
      StatePlace place{step, static_cast<double>(step) * scenario.scene.dt_s, label_of(i),
                       label_of(islands[i]), std::nullopt};
      if (!request.bodies.empty() &&
          std::ranges::find(request.bodies, place.label) == request.bodies.end())
        continue;
      if (state.position_m.allFinite()) place.world = map.owner_at(state.position_m);
      lines.add(state_line(place, state));
    }
  }
}

std::string seconds_of(std::int64_t ns) { return json_of(static_cast<double>(ns) / 1e9); }

template <class T>
std::string known_or_null(const std::optional<T>& value) {
  return value ? json_of(*value) : "null";
}

JsonObject world_line(const WorldStep& row, double dt_s) {
  JsonObject line;
  line.set("step", json_of(row.step))
      .set("time_s", json_of(static_cast<double>(row.step) * dt_s))
      .set("world", json_of(row.world));
  const auto set = [&line](const char* name, const auto& of, auto text) {
    line.set(name, of ? text(*of) : std::string("null"));
  };
  using Work = WorldStep::Work;
  using Bodies = WorldStep::Bodies;
  for (const auto& [name, member] : {std::pair("executed", &Work::executed),
                                     {"rolled_back", &Work::rolled_back},
                                     {"committed", &Work::committed},
                                     {"rollbacks", &Work::rollbacks},
                                     {"late", &Work::late},
                                     {"absorbed", &Work::absorbed}})
    set(name, row.work, [member](const Work& work) { return json_of(work.*member); });
  set("lead_steps", row.work, [](const Work& work) { return known_or_null(work.lead); });
  set("buffer_entries", row.work, [](const Work& work) { return known_or_null(work.entries); });
  for (const auto& [name, member] :
       {std::pair("began_s", &Work::began_ns), {"finished_s", &Work::finished_ns}})
    set(name, row.work, [member](const Work& work) {
      return work.executed > 0 ? seconds_of(work.*member) : "null";
    });
  set("committed_s", row.work,
      [](const Work& work) { return work.committed_ns ? seconds_of(*work.committed_ns) : "null"; });
  for (const auto& [name, member] :
       {std::pair("executing_s", &Work::executing_ns), {"wasted_s", &Work::wasted_ns}})
    set(name, row.work, [member](const Work& work) { return seconds_of(work.*member); });
  for (const auto& [name, member] : {std::pair("bodies", &Bodies::bodies),
                                     {"islands", &Bodies::islands},
                                     {"contacts", &Bodies::contacts}})
    set(name, row.bodies, [member](const Bodies& bodies) { return json_of(bodies.*member); });
  return line;
}

void add_worlds(LogReader& log, Lines& lines) {
  const scenarios::Scenario scenario = logged_scenario(log, {});
  read_world_steps(log, scenario,
                   [&](const WorldStep& row) { lines.add(world_line(row, scenario.scene.dt_s)); });
}

void add_inputs(LogReader& log, Lines& lines) {
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step)
    for (const models::CommittedInput& committed : log.read_step(step).inputs) {
      const models::UserInput& input = committed.input;
      lines.add(JsonObject()
                    .set("id", json_of(input.id))
                    .set("step", json_of(input.step))
                    .set("type", quoted(name_of(input.kind)))
                    .set("body", json_of(log.labels()[physics::index_of(input.body)]))
                    .set("had_effect", json_of(committed.had_effect)));
    }
}

std::string peer_of(const kernel::TraceRecord& record) {
  return record.peer == kernel::kExternalSource ? "null" : json_of(kernel::index_of(record.peer));
}

JsonObject event_line(std::uint32_t worker, const kernel::TraceRecord& record,
                      const std::vector<std::uint32_t>& labels) {
  using kernel::Happening;
  const Happening what = record.what;
  const bool is_gvt = what == Happening::kGvt;
  const bool is_of_message = kernel::is_of_message(what);
  const bool has_time =
      what != Happening::kCost && what != Happening::kSettled && record.time != kernel::kNever;
  std::string bodies;
  if (what == Happening::kLate)
    for (const std::uint32_t id : noted_bodies(record))
      bodies += (bodies.empty() ? "" : " ") + std::to_string(labels[id]);
  return JsonObject()
      .set("clock_s", json_of(1e-9 * static_cast<double>(record.clock_ns)))
      .set("worker", json_of(worker))
      .set("what", quoted(happening_name(what)))
      .set("world", is_gvt ? "null" : json_of(kernel::index_of(record.lp)))
      .set("step", has_time ? json_of(record.time.t) : "null")
      .set("event", has_time ? quoted(event_words(record.time)) : "null")
      .set("pass", has_time ? json_of(models::pass_of(record.time)) : "null")
      .set("round", has_time ? json_of(models::merge_round_of(record.time)) : "null")
      .set("anew", json_of(record.anew))
      .set("took_s",
           record.took_ns != 0 ? json_of(1e-9 * static_cast<double>(record.took_ns)) : "null")
      .set("peer", is_of_message ? peer_of(record) : "null")
      .set("message", is_of_message ? quoted(models::message_kinds()[record.kind]) : "null")
      .set("number", is_of_message ? json_of(record.version) : "null")
      .set("anti", is_of_message ? json_of(record.anti) : "null")
      .set("bodies", bodies.empty() ? std::string("null") : soda::analysis::quoted(bodies));
}

void add_events(LogReader& log, Lines& lines) {
  read_records_by_clock(log, logged_scenario(log, {}).territory.worlds,
                        [&](std::uint32_t worker, const kernel::TraceRecord& record) {
                          lines.add(event_line(worker, record, log.labels()));
                        });
}

std::string summary(LogReader& log) {
  std::vector<std::vector<std::string>> rows = {
      {"written by", "soda " + log.scenario().program_version},
      {"scenario", log.scenario().file},
      {"mesh files", std::to_string(log.meshes().size())},
      {"bodies", std::to_string(log.labels().size())},
      {"steps", std::to_string(log.last_step()) + (log.complete() ? "" : ", cut off")},
      {"blocks of trace", std::to_string(log.traces())}};
  std::size_t inputs = 0;
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step)
    inputs += log.read_step(step).inputs.size();
  rows.push_back({"user inputs", std::to_string(inputs)});
  if (log.execution_digest())
    rows.push_back({"execution digest", format_digest(*log.execution_digest())});
  for (const OptionText& option : in_words(log.options()))
    if (option.value != "not given") rows.push_back({option.name, option.value});
  return format_table({{"log"}, {""}}, rows);
}

// What would else be left out unsaid.
void check_options(const LogRequest& request) {
  const bool has_lines = request.json || request.csv;
  const bool has_states = has_lines && request.lines == "states";
  if (!request.bodies.empty() && !has_states)
    throw UsageError("--body: needs --lines states, with --csv or --json");
  if (request.every && !has_states && request.vtk_folder.empty())
    throw UsageError("--every: needs --vtk, or --lines states with --csv or --json");
  if (request.vtk_folder.empty() && request.surfaces) throw UsageError("--surfaces: needs --vtk");
  if (request.vtk_folder.empty() && request.force) throw UsageError("--force: needs --vtk");
  if (!has_lines && request.lines != "steps")
    throw UsageError("--lines " + request.lines + ": needs --csv or --json");
}

std::string files_written(const LogRequest& request, LogReader& log) {
  log.last_states();  // there are some
  const scenarios::Scenario scenario = logged_scenario(log, {});
  OutputFolder folder(request.vtk_folder, request.force, {".vtp", ".pvd"});
  const VtkCounts counts =
      write_vtk(log, scenario, {request.every.value_or(1), request.surfaces}, folder);
  return folder.folder() + ": " + std::to_string(counts.steps) + " of " +
         std::to_string(log.last_step() - log.first_step() + 1) + " states of " +
         std::to_string(log.labels().size()) + " bodies, " + std::to_string(counts.contacts) +
         " contact points; open bodies.pvd, contacts.pvd" +
         (request.surfaces ? ", surfaces.pvd" : "") + " and statics.vtp, in ParaView for example\n";
}

}  // namespace

int log_command(const LogRequest& request, std::ostream& out, std::ostream& err) {
  check_options(request);
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  if (!request.vtk_folder.empty()) {
    out << files_written(request, log);
  } else if (!request.json && !request.csv) {
    out << summary(log);
  } else {
    Lines lines(out, request.csv);
    if (request.lines == "steps") add_steps(log, lines);
    if (request.lines == "states") add_states(log, request, lines);
    if (request.lines == "worlds") add_worlds(log, lines);
    if (request.lines == "inputs") add_inputs(log, lines);
    if (request.lines == "events") add_events(log, lines);
    lines.finish();
  }
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
