#include "analysis/commands/search_json.hpp"

#include "analysis/process/stop_signals.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

// The object with a line for each key.
std::string lines_of(const JsonObject& object) {
  std::string text;
  for (const auto& [key, value] : object.fields)
    text += (text.empty() ? "{\n  " : ",\n  ") + quoted(key) + ": " + value;
  return text + "\n}\n";
}

std::string stop_json(const SearchEnd& end) {
  return end.stopped != 0 ? quoted(name_of_stop(end.stopped)) : "null";
}

std::string step_json(const LogDifference::Step& difference) {
  const auto& [step, what, body, values] = difference;
  JsonObject found;
  found.set("step", json_of(step)).set("what", quoted(what));
  if (!body) return found.text();
  const std::optional<std::uint64_t> ulps = ulps_between(values[0], values[1]);
  return found.set("body", json_of(*body))
      .set("first", finite_or_null(values[0]))
      .set("first_bits", quoted(format_bits(values[0])))
      .set("second", finite_or_null(values[1]))
      .set("second_bits", quoted(format_bits(values[1])))
      .set("ulps", ulps ? json_of(*ulps) : "null")
      .text();
}

std::string event_json(const HistoryDifference& event) {
  const auto side = [](const std::optional<kernel::TraceRecord>& record) {
    return record ? quoted(side_text(record)) : "null";
  };
  return JsonObject()
      .set("world", json_of(event.world))
      .set("happening", json_of(event.happening))
      .set("clock_s", json_of(1e-9 * static_cast<double>(event.clock_ns)))
      .set("first", side(event.first))
      .set("second", side(event.second))
      .text();
}

}  // namespace

std::string warnings_list(const std::vector<FileWarnings>& files) {
  std::vector<JsonObject> lines;
  for (const auto& [file, warnings] : files)
    for (const scenarios::InputWarning& warning : warnings)
      lines.emplace_back()
          .set("kind", quoted(warning.kind))
          .set("file", quoted(file))
          .set("line", json_of(warning.line))
          .set("column", json_of(warning.column))
          .set("pointer", quoted(warning.pointer))
          .set("found", quoted(warning.found))
          .set("likely", quoted(warning.likely))
          .set("more", json_of(warning.more));
  return list_of(lines, [](const JsonObject& line) { return line.text(); });
}

std::string contacts_json(const std::vector<StepContacts>& steps, const ContactNames& names) {
  const auto of_load = [&names](const physics::ContactLoad& load) {
    JsonObject point;
    point.set("body", json_of(names.labels[physics::index_of(load.a)]));
    if (physics::is_static(load.b))
      point.set("static", quoted(names.statics[physics::static_index_of(load.b)]));
    else
      point.set("other", json_of(names.labels[physics::index_of(load.b)]));
    return point.set("point_m", load.point ? json_of(load.point->position_m) : "null")
        .set("depth_m", load.point ? json_of(-load.point->separation_m) : "null")
        .set("normal", load.point ? json_of(load.normal) : "null")
        .set("normal_newton", finite_or_null(load.normal_newton))
        .set("friction_newton", json_of(load.friction_newton))
        .text();
  };
  return lines_of(JsonObject().set("steps", list_of(steps, [&of_load](const StepContacts& of) {
                                     return JsonObject()
                                         .set("step", json_of(of.step))
                                         .set("contacts", list_of(of.loads, of_load))
                                         .text();
                                   })));
}

std::string diff_json(const LogDifference& difference) {
  JsonObject json;
  json.set("settings", list_of(difference.settings,
                               [](const LogDifference::Setting& setting) {
                                 JsonObject line;
                                 return line.set("name", quoted(setting.name))
                                     .set("first", quoted(setting.values[0]))
                                     .set("second", quoted(setting.values[1]))
                                     .text();
                               }))
      .set("first_last_step", json_of(difference.last_steps[0]))
      .set("second_last_step", json_of(difference.last_steps[1]))
      .set("equal_steps", json_of(difference.equal_steps));
  json.set("difference", difference.step ? step_json(*difference.step) : "null");
  const std::string events = list_of(difference.events, event_json);
  return lines_of(json.set("events", difference.compares_events ? events : "null"));
}

std::string swarm_json(const SwarmResult& result) {
  JsonObject json;
  json.set("trials", json_of(result.trials))
      .set("out_of_time", json_of(result.out_of_time))
      .set("wall_s", json_of(result.wall_s))
      .set("executed", json_of(result.sums.executed))
      .set("rolled_back", json_of(result.sums.rolled_back))
      .set("committed", json_of(result.sums.committed))
      .set("rollbacks", json_of(result.sums.rollbacks))
      .set("anti_messages", json_of(result.sums.anti_messages))
      .set("failed", json_of(result.failure.has_value()))
      .set("warnings", warnings_list(result.warnings));
  if (!result.failure) return lines_of(json);
  JsonObject failure;
  failure.set("scenario", quoted(result.failure->file))
      .set("seed", json_of(result.failure->seed))
      .set("what", quoted(result.failure->what))
      .set("shrunk_what", quoted(result.failure->smallest.what))
      .set("command", quoted(result.failure->command));
  return lines_of(json.set("failure", failure.text()));
}

std::string fuzz_json(const FuzzResult& result) {
  const FuzzSums& sums = result.sums;
  JsonObject json;
  json.set("trials", json_of(result.trials))
      .set("out_of_time", json_of(result.out_of_time))
      .set("wall_s", json_of(result.wall_s))
      .set("steps", json_of(sums.steps))
      .set("islands", json_of(sums.islands))
      .set("contact_points", json_of(sums.contact_points))
      .set("most_iterations", json_of(sums.most_iterations))
      .set("most_multiplications", json_of(sums.most_multiplications))
      .set("largest_gain_rel", finite_or_null(sums.largest_gain))
      .set("push_out_work_joule", finite_or_null(sums.push_out_work_joule))
      .set("warnings", warnings_list(result.warnings));
  json.set("failures", list_of(result.failures, [](const FuzzFailure& failure) {
             JsonObject line;
             return line.set("seed", json_of(failure.seed))
                 .set("file", quoted(failure.file))
                 .set("what", quoted(failure.what))
                 .set("shrunk_what", quoted(failure.shrunk_what))
                 .set("scenario", quoted(failure.text))
                 .text();
           }));
  return lines_of(json);
}

std::string extremes_json(const ExtremesReport& report) {
  JsonObject json;
  json.set("must", json_of(kExtremesMust))
      .set("stretch", json_of(kExtremesStretch))
      .set("missed", json_of(report.beyond(kExtremesMust)));
  json.set("runs", list_of(report.runs, [](const ExtremeRun& run) {
             JsonObject line;
             return line.set("size_m", json_of(run.setting.size_m))
                 .set("dt_s", json_of(run.setting.dt_s))
                 .set("offset_m", json_of(run.setting.offset_m))
                 .set("mass_kg", json_of(run.setting.mass_kg))
                 .set("steps", json_of(run.steps))
                 .set("displacement_rel", finite_or_null(run.displacement_rel))
                 .set("fault", run.fault.empty() ? "null" : quoted(run.fault))
                 .text();
           }));
  return lines_of(json);
}

std::string whole_json(const WholeResult& result) {
  const WholeSums& sums = result.sums;
  JsonObject scenes, json;
  for (std::size_t i = 0; i < kRunExecutors; ++i)
    scenes.set(name_of(static_cast<RunExecutor>(i)), json_of(sums.scenes[i]));
  json.set("trials", json_of(result.trials))
      .set("out_of_time", json_of(result.end.out_of_time))
      .set("ended_early", stop_json(result.end))
      .set("wall_s", json_of(result.wall_s))
      .set("scenes", scenes.text())
      .set("left_out", quoted(result.left_out))
      .set("bodies", json_of(sums.bodies))
      .set("steps", json_of(sums.steps))
      .set("executed", json_of(sums.events))
      .set("rolled_back", json_of(sums.rolled_back))
      .set("rollbacks", json_of(sums.rollbacks))
      .set("runs_with_rollbacks", json_of(sums.runs_with_rollbacks))
      .set("migrations", json_of(sums.migrations))
      .set("replays", json_of(sums.replays))
      .set("plain_s", json_of(sums.plain_s))
      .set("program_s", json_of(sums.program_s));
  json.set("numerical_failures", list_of(result.suspicious, [](const SuspiciousScene& scene) {
             JsonObject line;
             return line.set("seed", json_of(scene.seed)).set("what", quoted(scene.what)).text();
           }));
  json.set("failures", list_of(result.failures, [](const WholeFailure& failure) {
             JsonObject line;
             return line.set("seed", json_of(failure.seed))
                 .set("kind", quoted(failure.kind))
                 .set("what", quoted(failure.what))
                 .set("shrunk_what", quoted(failure.shrunk_what))
                 .set("command", quoted(failure.command))
                 .set("file", quoted(failure.file))
                 .set("scenario", quoted(failure.text))
                 .text();
           }));
  return lines_of(json);
}

std::string continuity_json(const ContinuityResult& result) {
  JsonObject changes, json;
  for (std::size_t i = 0; i < kContinuityKinds; ++i) {
    const ContinuityTally& tally = result.tallies[i];
    JsonObject line;
    line.set("scenes", json_of(tally.trials))
        .set("same_bits", json_of(tally.same_bits))
        .set("rounding", json_of(tally.rounding))
        .set("failed", json_of(tally.failed))
        .set("steps", json_of(tally.steps))
        .set("worst_over_allowed", json_of(tally.worst));
    changes.set(name_of(static_cast<ContinuityKind>(i)), line.text());
  }
  json.set("out_of_time", json_of(result.end.out_of_time))
      .set("ended_early", stop_json(result.end))
      .set("wall_s", json_of(result.wall_s))
      .set("changes", changes.text());
  json.set("failures", list_of(result.failures, [](const ContinuityFailure& failure) {
             JsonObject line;
             return line.set("seed", json_of(failure.seed))
                 .set("change", quoted(name_of(failure.kind)))
                 .set("what", quoted(failure.what))
                 .text();
           }));
  return lines_of(json);
}

}  // namespace soda::analysis
