#include "analysis/trace/why_command.hpp"

#include <algorithm>
#include <numeric>
#include <ostream>
#include <set>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/event_log/state_text.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/trace/trace_json.hpp"
#include "analysis/trace/trace_words.hpp"
#include "analysis/trace/what_if_command.hpp"
#include "models/messages/schedule.hpp"
#include "models/world/event_kinds.hpp"

namespace soda::analysis {
namespace {

using models::Refused;

constexpr std::size_t kMostShown = 5;  // of a run, if not all are asked for

std::string ghosts_words(Refused why) {
  switch (why) {
    case Refused::kTouches:
      return "ghosts that touch";
    case Refused::kTouched:
      return "ghosts that had touched";
    case Refused::kMeetsSent:
      return "ghosts near a body sent on";
    case Refused::kIsOwn:
      return "ghosts of a body that changed hands";
    case Refused::kInDoubt:
    case Refused::kUnknown:
      break;
  }
  return "ghosts";
}

// Of a time with a body in it: what the user has chosen to look at.
bool is_wanted(const ExecutionTrace& trace, RollbackNumber number, const WhyRequest& request,
               const std::optional<std::uint32_t>& body) {
  const TracedRollback& rollback = trace.rollbacks[number];
  if (request.rollback && *request.rollback != number + 1) return false;
  if (request.world && *request.world != rollback.world) return false;
  if (request.step && rollback.changed.t != *request.step &&
      std::ranges::none_of(rollback.undone, [&](ExecutionNumber undone) {
        return trace.executions[undone].time.t == *request.step;
      }))
    return false;
  if (!body) return true;
  const kernel::Refusal& refusal = rollback.refusal;
  if (refusal.code != 0 && (refusal.subject == *body || refusal.other == *body)) return true;
  return std::ranges::any_of(rollback.late, [&](std::size_t late) {
    return std::ranges::binary_search(trace.late[late].bodies, *body);
  });
}

std::optional<std::uint32_t> body_of(const WhyRequest& request, const LogReader& log) {
  if (!request.body) return std::nullopt;
  return physics::index_of(body_of_label(log.labels(), *request.body, "--body: " + request.file));
}

std::string causes_text(const ExecutionTrace& trace) {
  const std::map<std::string, CauseCost> causes = causes_of(trace);
  std::vector<std::pair<std::string, CauseCost>> ranked(causes.begin(), causes.end());
  std::ranges::stable_sort(ranked, std::ranges::greater(),
                           [](const auto& cause) { return cause.second.wasted_with_all_ns; });
  std::int64_t wasted_ns = 0;
  for (const auto& [name, cost] : ranked) wasted_ns += cost.wasted_ns;
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, cost] : ranked) {
    const double share = wasted_ns > 0 ? 100.0 * static_cast<double>(cost.wasted_with_all_ns) /
                                             static_cast<double>(wasted_ns)
                                       : 0.0;
    rows.push_back({name, std::to_string(cost.rollbacks), std::to_string(cost.undone),
                    std::to_string(cost.put_back), milliseconds(cost.wasted_ns),
                    milliseconds(cost.wasted_with_all_ns), format_number(share, 3) + " %"});
  }
  return format_table({{"cause"},
                       {"rollbacks", Align::kRight},
                       {"events undone", Align::kRight},
                       {"put back", Align::kRight},
                       {"work in vain", Align::kRight},
                       {"with all that followed", Align::kRight},
                       {"of all", Align::kRight}},
                      rows);
}

std::vector<RollbackNumber> chosen(const ExecutionTrace& trace, const WhyRequest& request,
                                   const std::optional<std::uint32_t>& body) {
  std::vector<RollbackNumber> numbers;
  for (RollbackNumber number = 0; number < trace.rollbacks.size(); ++number)
    if (is_wanted(trace, number, request, body)) numbers.push_back(number);
  const bool filtered = request.world || request.step || request.body || request.rollback;
  if (filtered || request.all || numbers.size() <= kMostShown) return numbers;
  std::ranges::stable_sort(numbers, std::ranges::greater(),
                           [&trace](RollbackNumber number) { return trace.wasted_ns(number); });
  numbers.resize(kMostShown);
  return numbers;
}

}  // namespace

std::string cause_of(const ExecutionTrace& trace, RollbackNumber number) {
  const TracedRollback& rollback = trace.rollbacks[number];
  if (rollback.late.empty()) return "a test";
  const LateMessage& message = trace.late[rollback.late.front()];
  const bool are_ghosts = message.kind == static_cast<std::uint32_t>(models::MessageKind::kGhosts);
  const std::string what = are_ghosts ? ghosts_words(static_cast<Refused>(rollback.refusal.code))
                                      : message_words(message.kind);
  return message.anti ? "taken back: " + what : what;
}

std::vector<RollbackNumber> chain_of(const ExecutionTrace& trace, RollbackNumber rollback) {
  std::vector<RollbackNumber> chain = {rollback};
  std::set<RollbackNumber> seen = {rollback};
  for (auto next = trace.led_to(rollback); next && seen.insert(*next).second;
       next = trace.led_to(*next))
    chain.push_back(*next);
  return chain;
}

std::string chain_text(const ExecutionTrace& trace, RollbackNumber number,
                       const std::vector<std::uint32_t>& labels) {
  std::string text;
  for (const RollbackNumber link : chain_of(trace, number))
    text += (text.empty() ? "" : "because of ") + why_text(trace, link, labels);
  return text;
}

std::map<std::string, CauseCost> causes_of(const ExecutionTrace& trace) {
  std::map<std::string, CauseCost> causes;
  for (RollbackNumber number = 0; number < trace.rollbacks.size(); ++number) {
    CauseCost& cost = causes[cause_of(trace, number)];
    ++cost.rollbacks;
    cost.undone += trace.rollbacks[number].undone.size();
    cost.put_back += trace.rollbacks[number].put_back;
    cost.wasted_ns += trace.wasted_ns(number);
    causes[cause_of(trace, chain_of(trace, number).back())].wasted_with_all_ns +=
        trace.wasted_ns(number);
  }
  return causes;
}

int why_command(const WhyRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  const std::uint32_t worlds = logged_scenario(log, {}).territory.worlds;
  const std::optional<std::uint32_t> body = body_of(request, log);
  const ExecutionTrace trace = read_trace(log, worlds);
  const std::vector<RollbackNumber> numbers = chosen(trace, request, body);
  const std::vector<WhatIf> helps = request.all ? what_would_help(log) : std::vector<WhatIf>();
  if (request.json) {
    out << why_json(trace, numbers, helps, log.labels());
  } else if (trace.rollbacks.empty()) {
    out << request.file << ": nothing was rolled back\n";
  } else {
    out << request.file << ": " << counted(trace.rollbacks.size(), "rollback") << " in "
        << counted(worlds, "world") << "\n\n"
        << causes_text(trace) << "\n";
    for (const RollbackNumber number : numbers)
      out << chain_text(trace, number, log.labels()) << "\n";
    if (request.all) out << what_if_text(helps);
  }
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
