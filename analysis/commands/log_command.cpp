#include "analysis/commands/log_command.hpp"

#include <ostream>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/measures/input_measures.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/trace/trace_records.hpp"
#include "analysis/trace/trace_words.hpp"
#include "kernel/api/outside.hpp"
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

void add_states(LogReader& log, Lines& lines) {
  log.last_states();  // there are some
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step) {
    if (!has_states(log.options(), step)) continue;
    const LoggedStep logged = log.read_states(step);
    for (std::size_t i = 0; i < logged.ids.size(); ++i) {
      const physics::BodyState& state = logged.states[i];
      JsonObject line;
      line.set("step", json_of(step))
          .set("body", json_of(log.labels()[physics::index_of(logged.ids[i])]));
      const auto add = [&line](const char* name, const auto& vector) {
        constexpr const char* kAxes[] = {"x", "y", "z"};
        for (int axis = 0; axis < 3; ++axis)
          line.set(std::string(name) + kAxes[axis], finite_or_null(vector[axis]));
      };
      add("", state.position_m);
      line.set("qw", finite_or_null(state.orientation.w()));
      add("q", state.orientation.vec());
      add("v", state.linear_velocity_m_s);
      add("w", state.angular_velocity_rad_s);
      lines.add(line);
    }
  }
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
  return record.peer == kernel::kOutside ? "null" : json_of(kernel::index_of(record.peer));
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
      .set("number", is_of_message ? json_of(record.incarnation) : "null")
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

}  // namespace

int log_command(const LogRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  if (!request.json && !request.csv) {
    out << summary(log);
  } else {
    Lines lines(out, request.csv);
    if (request.lines == "steps") add_steps(log, lines);
    if (request.lines == "states") add_states(log, lines);
    if (request.lines == "inputs") add_inputs(log, lines);
    if (request.lines == "events") add_events(log, lines);
    lines.finish();
  }
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
