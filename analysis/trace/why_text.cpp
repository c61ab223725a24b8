// A rollback and what led to it, as sentences.
#include <algorithm>

#include "analysis/trace/trace_words.hpp"
#include "analysis/trace/why_command.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"
#include "models/world/event_kinds.hpp"

namespace soda::analysis {
namespace {

using models::Refused;

std::string body_words(std::uint64_t id, const std::vector<std::uint32_t>& labels) {
  return id < labels.size() ? "body " + std::to_string(labels[id]) : "a static";
}

// Why the news mattered, if the world has said so; begins with a space.
std::string refusal_words(const TracedRollback& rollback,
                          const std::vector<std::uint32_t>& labels) {
  const std::string subject = body_words(rollback.refusal.subject, labels);
  const std::string other = body_words(rollback.refusal.other, labels);
  switch (static_cast<Refused>(rollback.refusal.code)) {
    case Refused::kTouches:
      return " " + subject + " touches " + other + ".";
    case Refused::kTouched:
      return " " + subject + " had touched " + other + ", and is not where it was taken to be.";
    case Refused::kIsOwn:
      return " " + subject + " had been its own in that step.";
    case Refused::kMeetsSent:
      return " " + subject + " may meet a body that a hit has sent on.";
    case Refused::kInDoubt:
      return " Nothing was known of the cells that " + subject + " covers.";
    case Refused::kUnknown:
      break;
  }
  return "";
}

std::string bodies_words(const LateMessage& message, const std::vector<std::uint32_t>& labels) {
  constexpr std::size_t kMost = 6;
  if (message.bodies.empty()) return "";
  std::string text = message.bodies.size() == 1 ? " of body " : " of bodies ";
  for (std::size_t i = 0; i < std::min(kMost, message.bodies.size()); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(labels[message.bodies[i]]);
  if (message.bodies.size() > kMost)
    text += " and " + std::to_string(message.bodies.size() - kMost) + " more";
  return text;
}

// When the world had been there that a late message is for: what was undone of that time first.
std::optional<std::int64_t> began_before(const ExecutionTrace& trace,
                                         const TracedRollback& rollback) {
  std::optional<std::int64_t> began;
  for (const ExecutionNumber number : rollback.undone) {
    const TracedExecution& execution = trace.executions[number];
    if (execution.time >= rollback.changed && !execution.absorbed)
      began = began ? std::min(*began, execution.began_ns) : execution.began_ns;
  }
  return began;
}

std::string late_words(const ExecutionTrace& trace, const TracedRollback& rollback,
                       const LateMessage& message, const std::vector<std::uint32_t>& labels) {
  std::string text = "  " + std::string(message.anti ? "Taken back: " : "Late: ") +
                     message_words(message.kind) + bodies_words(message, labels);
  if (message.from == kernel::index_of(kernel::kExternalSource)) {
    text += ", from outside";
  } else {
    text += ", from world " + std::to_string(message.from) + " (message " +
            message_name(message.from, message.version) + ")";
  }
  text += ", came at " + milliseconds(message.arrived_ns);
  if (const auto began = began_before(trace, rollback))
    text += ", " + milliseconds(message.arrived_ns - *began) + " after world " +
            std::to_string(rollback.world) + " had gone on without " +
            (message.anti ? "knowing that" : "it");
  text += ".\n";
  const std::string did = "  World " + std::to_string(message.from) +
                          (message.anti ? " took it back in " : " sent it in ");
  if (!message.sent_by)
    return message.sent_in ? text + did + "rollback " + std::to_string(*message.sent_in + 1) + ".\n"
                           : text;
  const TracedExecution& sender = trace.executions[*message.sent_by];
  text += did + words_of(sender.time) + ", which it began at " + milliseconds(sender.began_ns);
  text += sender.again_for ? ", again after rollback " + std::to_string(*sender.again_for + 1)
                           : ", for the first time";
  return text + ".\n";
}

std::string undone_words(const ExecutionTrace& trace, RollbackNumber number) {
  const TracedRollback& rollback = trace.rollbacks[number];
  if (rollback.undone.empty()) return "  Nothing had to be undone.\n";
  std::int64_t first = rollback.restart.t, last = first;
  for (const ExecutionNumber execution : rollback.undone)
    last = std::max(last, trace.executions[execution].time.t);
  std::string text = "  Undone: " + counted(rollback.undone.size(), "event") + " of step" +
                     (first == last ? " " + std::to_string(first)
                                    : "s " + std::to_string(first) + " to " + std::to_string(last));
  if (rollback.put_back > 0)
    text += "; " + std::to_string(rollback.put_back) + " of them stood again as they were";
  return text + "; " + milliseconds(trace.wasted_ns(number)) + " of work in vain.\n";
}

}  // namespace

std::string why_text(const ExecutionTrace& trace, RollbackNumber number,
                     const std::vector<std::uint32_t>& labels) {
  const TracedRollback& rollback = trace.rollbacks[number];
  std::string text =
      "rollback " + std::to_string(number + 1) + " of " + std::to_string(trace.rollbacks.size()) +
      ", at " + milliseconds(rollback.at_ns) + ": world " + std::to_string(rollback.world) +
      " went back to step " + std::to_string(rollback.restart.t) + ", for " +
      words_of(rollback.changed) + " has changed." + refusal_words(rollback, labels) + "\n";
  for (const std::size_t late : rollback.late)
    text += late_words(trace, rollback, trace.late[late], labels);
  if (rollback.late.empty()) text += "  No message did it: a test undid it.\n";
  return text + undone_words(trace, number);
}

}  // namespace soda::analysis
