#include "analysis/trace/trace_json.hpp"

#include "analysis/text/json_text.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/trace/trace_words.hpp"
#include "kernel/api/external_source.hpp"
#include "models/world/event_kinds.hpp"

namespace soda::analysis {
namespace {

constexpr const char* kRefusals[] = {"unknown",       "touches", "touched",
                                     "changed_hands", "sent_on", "in_doubt"};

std::string seconds(std::int64_t ns) { return json_of(1e-9 * static_cast<double>(ns)); }

template <class T>
std::string number_or_null(const std::optional<T>& value) {
  return value ? json_of(*value) : "null";
}

JsonObject time_object(kernel::VirtualTime time) {
  return JsonObject()
      .set("step", json_of(time.t))
      .set("round", json_of(time.round))
      .set("kind", quoted(event_words(time)));
}

std::string late_json(const ExecutionTrace& trace, const LateMessage& message,
                      const std::vector<std::uint32_t>& labels) {
  JsonObject json;
  const bool external = message.from == kernel::index_of(kernel::kExternalSource);
  json.set("message", quoted(std::to_string(message.from) + ":" + std::to_string(message.version)))
      .set("from", external ? "null" : json_of(message.from))
      .set("kind", quoted(models::message_kinds()[message.kind]))
      .set("anti", json_of(message.anti))
      .set("arrived_s", seconds(message.arrived_ns))
      .set("bodies",
           list_of(message.bodies, [&labels](std::uint32_t id) { return json_of(labels[id]); }));
  if (!message.sent_by) return json.set("sent_in", "null").text();
  const TracedExecution& sender = trace.executions[*message.sent_by];
  return json
      .set("sent_in", time_object(sender.time)
                          .set("began_s", seconds(sender.began_ns))
                          .set("again", json_of(sender.again_for.has_value()))
                          .text())
      .text();
}

std::string rollback_json(const ExecutionTrace& trace, RollbackNumber number,
                          const std::vector<std::uint32_t>& labels) {
  const TracedRollback& rollback = trace.rollbacks[number];
  const auto body = [&labels](std::uint64_t id) {
    return id < labels.size() ? json_of(labels[id]) : std::string("null");
  };
  const bool tells = rollback.refusal.code != 0;
  std::optional<std::size_t> led_to = trace.led_to(number);
  if (led_to) ++*led_to;
  return JsonObject()
      .set("rollback", json_of(number + 1))
      .set("at_s", seconds(rollback.at_ns))
      .set("world", json_of(rollback.world))
      .set("changed", time_object(rollback.changed).text())
      .set("restart_step", json_of(rollback.restart.t))
      .set("cause", quoted(cause_of(trace, number)))
      .set("reason", quoted(kRefusals[rollback.refusal.code]))
      .set("body", tells ? body(rollback.refusal.subject) : "null")
      .set("other_body", tells ? body(rollback.refusal.other) : "null")
      .set("undone", json_of(rollback.undone.size()))
      .set("put_back", json_of(rollback.put_back))
      .set("wasted_s", seconds(trace.wasted_ns(number)))
      .set("because_of", number_or_null(led_to))
      .set("late",
           list_of(rollback.late,
                   [&](std::size_t late) { return late_json(trace, trace.late[late], labels); }))
      .text();
}

JsonObject modelled_object(const ModelledRun& run) {
  return JsonObject()
      .set("makespan_s", seconds(run.makespan_ns))
      .set("executed", json_of(run.executed))
      .set("rolled_back", json_of(run.rolled_back))
      .set("rollbacks", json_of(run.rollbacks))
      .set("stragglers", json_of(run.stragglers))
      .set("digest", quoted(format_digest(run.digest)));
}

JsonObject what_if_object(const WhatIf& what) {
  return JsonObject()
      .set("change", quoted(what.change))
      .set("before", modelled_object(what.before).text())
      .set("after", modelled_object(what.after).text())
      .set("message_was_late", json_of(what.after.awaited_was_late));
}

}  // namespace

std::string why_json(const ExecutionTrace& trace, const std::vector<RollbackNumber>& numbers,
                     const std::vector<WhatIf>& helps, const std::vector<std::uint32_t>& labels) {
  const auto causes = causes_of(trace);
  return JsonObject()
             .set("worlds", json_of(trace.worlds))
             .set("rollbacks", json_of(trace.rollbacks.size()))
             .set("causes", list_of(causes,
                                    [](const auto& cause) {
                                      const auto& [name, cost] = cause;
                                      return JsonObject()
                                          .set("cause", quoted(name))
                                          .set("rollbacks", json_of(cost.rollbacks))
                                          .set("undone", json_of(cost.undone))
                                          .set("put_back", json_of(cost.put_back))
                                          .set("wasted_s", seconds(cost.wasted_ns))
                                          .set("wasted_with_all_s",
                                               seconds(cost.wasted_with_all_ns))
                                          .text();
                                    }))
             .set("found", list_of(numbers,
                                   [&](RollbackNumber number) {
                                     return rollback_json(trace, number, labels);
                                   }))
             .set("what_would_help",
                  list_of(helps, [](const WhatIf& what) { return what_if_object(what).text(); }))
             .text() +
         "\n";
}

std::string what_if_json(const WhatIf& what) { return what_if_object(what).text() + "\n"; }

}  // namespace soda::analysis
