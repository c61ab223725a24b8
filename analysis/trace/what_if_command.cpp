#include "analysis/trace/what_if_command.hpp"

#include <algorithm>
#include <charconv>
#include <ostream>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/trace/execution_trace.hpp"
#include "analysis/trace/trace_json.hpp"
#include "analysis/trace/trace_words.hpp"

namespace soda::analysis {
namespace {

// What a run over threads or ranks is modelled on: as many processors.
Overrides on_a_cluster(const LogReader& log, Overrides overrides) {
  const LoggedOptions& logged = log.options();
  if (!logged.overrides.cluster.given() &&
      logged.overrides.executor != models::ExecutorKind::kVirtual) {
    const unsigned threads = logged.overrides.threads.value_or(1) * std::max(1u, logged.ranks);
    if (!overrides.cluster.processors && (logged.overrides.threads || logged.ranks > 0))
      overrides.cluster.processors = threads;
  }
  overrides.executor = models::ExecutorKind::kVirtual;
  return overrides;
}

// Whether the message that was waited for came late: the first that would do, of all that a trace
// tells of.
class Arrival {
 public:
  explicit Arrival(const kernel::AwaitedMessage& awaited) : awaited_(awaited) {}

  void look_into(std::span<const std::byte> bytes) {
    kernel::TraceChunk chunk(bytes);
    for (kernel::TraceRecord record; chunk.next(record);) {
      if (!is_awaited(record)) continue;
      if (record.what == kernel::Happening::kArrived && !first_) first_ = record.version;
      if (record.what == kernel::Happening::kLate && first_ == record.version) was_late_ = true;
    }
  }
  bool was_late() const { return was_late_; }

 private:
  bool is_awaited(const kernel::TraceRecord& record) const {
    return record.lp == awaited_.destination && record.peer == awaited_.source &&
           record.time == awaited_.time && record.kind == awaited_.kind &&
           record.slot == awaited_.slot && record.version >= awaited_.version;
  }

  const kernel::AwaitedMessage awaited_;
  std::optional<std::uint64_t> first_;
  bool was_late_ = false;
};

ModelledRun run_modelled(LogReader& log, const Overrides& overrides,
                         const std::optional<kernel::AwaitedMessage>& awaited) {
  scenarios::Scenario scenario = logged_scenario(log, on_a_cluster(log, overrides));
  scenario.run.cluster.awaited = awaited;
  ModelledRun modelled;
  models::CommitObserver observer;
  Arrival arrival(awaited.value_or(kernel::AwaitedMessage{}));
  observer.wants_trace = awaited.has_value();
  observer.on_trace = [&](std::span<const std::byte> chunk) { arrival.look_into(chunk); };
  const MeasuredRun run =
      measure_run(scenario.scene, scenario.initial, scenario.territory, scenario.run, observer, {});
  modelled.makespan_ns = run.result.cluster->makespan_ns;
  modelled.executed = run.result.events.executed;
  modelled.rolled_back = run.result.events.rolled_back;
  modelled.rollbacks = run.result.events.rollbacks;
  modelled.stragglers = run.result.events.stragglers;
  modelled.digest = run.digest;
  modelled.awaited_was_late = arrival.was_late();
  return modelled;
}

kernel::AwaitedMessage message_of(const WhatIfRequest& request, LogReader& log) {
  const std::string& name = request.deliver_in_time;
  std::uint32_t from = 0;
  std::uint64_t number = 0;
  const char* const end = name.data() + name.size();
  const auto [colon, wrong] = std::from_chars(name.data(), end, from);
  const bool is_name = wrong == std::errc() && colon != end && *colon == ':' &&
                       std::from_chars(colon + 1, end, number).ptr == end && colon + 1 != end;
  if (!is_name)
    throw UsageError("--deliver-in-time: found " + name +
                     "; allowed: SOURCE:NUMBER, as soda why names a message");
  if (!log.execution_digest())
    throw UsageError("--deliver-in-time: " + request.file +
                     " is of no virtual run that can be executed again event for event");
  const ExecutionTrace trace = read_trace(log, logged_scenario(log, {}).territory.worlds);
  const auto found = std::ranges::find_if(trace.late, [&](const LateMessage& message) {
    return message.from == from && message.version == number;
  });
  if (found == trace.late.end())
    throw UsageError("--deliver-in-time: message " + name + " was not late in " + request.file);
  return {.source = kernel::LpId{from},
          .destination = kernel::LpId{found->to},
          .time = found->time,
          .kind = found->kind,
          .slot = found->slot,
          .version = number};
}

std::string change_words(const WhatIfRequest& request) {
  std::string text;
  LoggedOptions changed;
  changed.overrides = request.overrides;
  const std::vector<OptionText> given = in_words(changed), none = in_words(LoggedOptions{});
  for (std::size_t i = 0; i < given.size(); ++i)
    if (given[i].value != none[i].value)
      text += (text.empty() ? "" : ", ") + given[i].name + " " + given[i].value;
  if (request.deliver_in_time.empty()) return text;
  return text + (text.empty() ? "" : ", ") + "message " + request.deliver_in_time + " in time";
}

}  // namespace

std::vector<WhatIf> what_would_help(LogReader& log) {
  const ModelledRun before = run_modelled(log, {}, std::nullopt);
  const scenarios::Scenario scenario = logged_scenario(log, {});
  std::vector<WhatIf> all;
  const auto add = [&](const std::string& change, const Overrides& overrides) {
    all.push_back({change, before, run_modelled(log, overrides, std::nullopt)});
  };
  Overrides overrides;
  if (!scenario.run.gating) {
    overrides.gating = true;
    add("gating on", overrides);
  }
  const std::int64_t buffer = scenario.run.buffer;
  for (const std::int64_t other : {buffer / 2, 2 * buffer}) {
    if (other < 1) continue;
    overrides = {};
    overrides.buffer = other;
    add("buffer of " + std::to_string(other), overrides);
  }
  if (scenario.run.balancing.policy == models::BalancingPolicy::kOff) {
    overrides = {};
    overrides.balancing = models::BalancingPolicy::kPaper;
    add("territories that follow the load (--balancing paper)", overrides);
  }
  std::ranges::stable_sort(all, {}, [](const WhatIf& what) { return what.after.makespan_ns; });
  return all;
}

std::string what_if_text(const std::vector<WhatIf>& all) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&rows](const std::string& name, const ModelledRun& run, double gain) {
    rows.push_back({name, milliseconds(run.makespan_ns), format_number(gain, 3),
                    std::to_string(run.executed), std::to_string(run.rolled_back),
                    std::to_string(run.rollbacks)});
  };
  if (all.empty()) return "";
  add("as it was", all.front().before, 1.0);
  for (const WhatIf& what : all)
    add(what.change, what.after,
        static_cast<double>(what.before.makespan_ns) /
            static_cast<double>(std::max<std::int64_t>(what.after.makespan_ns, 1)));
  return format_table({{"on the virtual cluster"},
                       {"makespan", Align::kRight},
                       {"times as fast", Align::kRight},
                       {"events", Align::kRight},
                       {"rolled back", Align::kRight},
                       {"rollbacks", Align::kRight}},
                      rows);
}

int what_if_command(const WhatIfRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  std::optional<kernel::AwaitedMessage> awaited;
  if (!request.deliver_in_time.empty()) awaited = message_of(request, log);
  const std::string change = change_words(request);
  if (change.empty()) throw UsageError("nothing is changed; see soda what-if --help");
  WhatIf what{change, run_modelled(log, {}, std::nullopt), {}};
  what.after = run_modelled(log, request.overrides, awaited);
  out << (request.json ? what_if_json(what) : what_if_text({what}));
  if (what.before.digest != what.after.digest) {
    err << "soda: " << request.file << ": the change changes the trajectory: digest "
        << format_digest(what.after.digest) << ", before " << format_digest(what.before.digest)
        << "\n";
    return kExitCheckFailed;
  }
  if (awaited && !request.json)
    out << "\nmessage " << request.deliver_in_time
        << (what.after.awaited_was_late ? " came late all the same\n" : " came in time\n");
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
