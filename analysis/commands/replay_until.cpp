#include "analysis/commands/replay_until.hpp"

#include <algorithm>
#include <array>
#include <ostream>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/event_log/state_text.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/trace/event_pattern.hpp"
#include "analysis/trace/recorded_order.hpp"
#include "analysis/trace/trace_words.hpp"
#include "analysis/trace/why_command.hpp"
#include "kernel/api/external_source.hpp"

namespace soda::analysis {
namespace {

// Where a replay stops.
struct Stop {
  std::size_t number = 0;                  // so many happenings are over
  std::optional<RollbackNumber> rollback;  // it is what comes next, or was last
};

std::size_t stop_named(const std::string& text, const std::string& option, std::uint32_t worlds,
                       const RecordedWalk& walk, const LogReader& log) {
  const EventPattern event = parse_event(text, worlds, option);
  const auto found = find_event(walk, event, 0);
  if (!found) throw UsageError(option + ": " + log.file() + " " + refusal_of(walk, event, text));
  return *found;
}

Stop stop_of(const ReplayRequest& request, const LogReader& log, const RecordedWalk& walk,
             const ExecutionTrace& trace) {
  const bool before = request.until.empty();
  const std::size_t found =
      before ? stop_named(request.break_before, "--break", trace.worlds, walk, log)
             : stop_named(request.until, "--until", trace.worlds, walk, log);
  Stop stop{before ? found - 1 : found, std::nullopt};
  if (walk[found - 1].record.what == kernel::Happening::kRewound)
    stop.rollback = last_rollback(walk, found, trace);
  return stop;
}

std::string time_json(const std::optional<kernel::VirtualTime>& time) {
  return time ? quoted(words_of(*time)) : "null";
}

std::string worlds_json(const Situation& situation) {
  std::uint32_t id = 0;
  return list_of(situation.worlds, [&id](const WorldSituation& world) {
    return JsonObject()
        .set("world", json_of(id++))
        .set("executed", time_json(world.executed))
        .set("committed", time_json(world.committed))
        .set("events_ahead", json_of(world.ahead))
        .set("entries", json_of(world.entries))
        .set("messages_waiting", json_of(world.waiting))
        .set("messages_in_flight", json_of(world.in_flight))
        .set("rollbacks", json_of(world.rollbacks))
        .text();
  });
}

// What is speculative need not be finite.
template <class Numbers>
std::string numbers_json(const Numbers& numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "[" : ",") + finite_or_null(number);
  return text + "]";
}

std::array<double, 4> in_order(const physics::Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

std::string stands_json(const std::vector<models::WorldStand>& stands,
                        const std::vector<std::uint32_t>& labels,
                        const std::optional<physics::BodyId>& body) {
  std::vector<std::string> lines;
  for (const models::WorldStand& stand : stands)
    for (std::size_t i = 0; i < stand.ids.size(); ++i) {
      if (body && stand.ids[i] != *body) continue;
      const physics::BodyState& state = stand.states[i];
      lines.push_back(JsonObject()
                          .set("world", json_of(models::index_of(stand.world)))
                          .set("step", json_of(stand.step))
                          .set("body", json_of(labels[physics::index_of(stand.ids[i])]))
                          .set("position_m", numbers_json(state.position_m))
                          .set("orientation", numbers_json(in_order(state.orientation)))
                          .set("linear_velocity_m_s", numbers_json(state.linear_velocity_m_s))
                          .set("angular_velocity_rad_s", numbers_json(state.angular_velocity_rad_s))
                          .text());
    }
  return list_of(lines, [](const std::string& line) { return line; });
}

}  // namespace

std::string stands_text(const std::vector<models::WorldStand>& stands,
                        const std::vector<std::uint32_t>& labels,
                        const std::optional<physics::BodyId>& body) {
  std::vector<Column> columns = {{"world", Align::kRight}, {"after step", Align::kRight}};
  std::ranges::copy(state_columns(), std::back_inserter(columns));
  std::vector<std::vector<std::string>> rows;
  std::string text;
  for (const models::WorldStand& stand : stands)
    for (std::size_t i = 0; i < stand.ids.size(); ++i) {
      const std::uint32_t label = labels[physics::index_of(stand.ids[i])];
      const std::string world = std::to_string(models::index_of(stand.world));
      if (!body) {
        rows.push_back({world, std::to_string(stand.step)});
        std::ranges::copy(state_cells(label, stand.states[i]), std::back_inserter(rows.back()));
      } else if (stand.ids[i] == *body) {
        text += "world " + world + " has body " + std::to_string(label) + " after step " +
                std::to_string(stand.step) + " so:\n\n" + state_in_full(stand.states[i]);
      }
    }
  if (!body) return format_table(columns, rows);
  return text.empty() ? "no world has body " + std::to_string(labels[physics::index_of(*body)]) +
                            ": it is not there, or on its way to another world\n"
                      : text;
}

int replay_until(const ReplayRequest& request, LogReader& log, std::ostream& out) {
  const scenarios::Scenario scenario = logged_scenario(log, {});
  const std::uint32_t worlds = scenario.territory.worlds;
  const std::vector<std::uint32_t>& labels = log.labels();
  std::optional<physics::BodyId> body;
  if (request.body) body = body_of_label(labels, *request.body, "--body: " + request.file);
  const RecordedWalk walk = recorded_walk(log, worlds);
  const ExecutionTrace trace = read_trace(log, worlds);
  const Stop stop = stop_of(request, log, walk, trace);
  const Situation situation = situation_after(walk, stop.number, worlds, log.first_step());
  const std::vector<models::WorldStand> stands =
      stands_as_executed(log, scenario, walk, stop.number);
  std::string story;
  if (stop.rollback) story = chain_text(trace, *stop.rollback, labels);
  if (request.json) {
    out << JsonObject()
               .set("happening", json_of(stop.number))
               .set("happenings", json_of(walk.size()))
               .set("place", quoted(place_text(walk, stop.number)))
               .set("gvt_step",
                    situation.gvt == kernel::kBeginning || situation.gvt == kernel::kNever
                        ? "null"
                        : json_of(situation.gvt.t))
               .set("rollback", stop.rollback ? json_of(*stop.rollback + 1) : "null")
               .set("story", story.empty() ? "null" : soda::analysis::quoted(story))
               .set("worlds", worlds_json(situation))
               .set("bodies", stands_json(stands, labels, body))
               .text()
        << "\n";
    return kExitOk;
  }
  out << request.file << ": stopped after " << place_text(walk, stop.number) << "\n";
  if (stop.number < walk.size())
    out << "what comes next: " << happening_text(walk[stop.number]) << "\n";
  if (!story.empty()) out << "\n" << story;
  out << "\n"
      << situation_text(situation, scenario.run.buffer) << "\n"
      << stands_text(stands, labels, body);
  return kExitOk;
}

}  // namespace soda::analysis
