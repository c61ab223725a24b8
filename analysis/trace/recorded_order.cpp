#include "analysis/trace/recorded_order.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/trace/trace_comparison.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"
#include "models/options/run_stages.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;

[[noreturn]] void refuse_repetition(const LogReader& log, const std::string& why) {
  throw UsageError(log.file() + " " + why +
                   " (soda replay --until goes up to an event, --interactive walks through all)");
}

bool is_in_sequence(const scenarios::Scenario& scenario) {
  return models::executor_of(scenario.run, scenario.territory.worlds) ==
         models::ExecutorKind::kSequential;
}

// What balancing decided, in order of steps.
std::vector<models::TerritoryChange> changes_in(LogReader& log,
                                                const scenarios::Scenario& scenario) {
  std::vector<models::TerritoryChange> changes;
  if (!models::balancing_needed(scenario.run, scenario.territory.worlds)) return changes;
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step)
    std::ranges::copy(log.read_step(step).territory_changes, std::back_inserter(changes));
  return changes;
}

// The acts of a trace; the rest follows from those.
class Acts {
 public:
  Acts(const LogReader& log, const scenarios::Scenario& scenario,
       std::vector<models::TerritoryChange> changes)
      : file_(log.file()) {
    execution_.order.in_sequence = is_in_sequence(scenario);
    execution_.over_ranks = log.options().ranks > 1;
    for (const models::UserInput& input : scenario.run.inputs.script)
      known_.insert({input.step, models::MessageKind::kInputs, input.id});
    for (const models::TerritoryChange& change : changes)
      known_.insert({change.step, models::MessageKind::kTransfers, 0});
    execution_.territory_changes = std::move(changes);
  }

  void add(std::uint32_t worker, const TraceRecord& record) {
    std::vector<std::vector<kernel::RecordedAct>>& workers = execution_.order.workers;
    if (worker >= workers.size()) workers.resize(worker + 1);
    switch (record.what) {
      case Happening::kArrived:
        if (record.peer == kernel::kExternalSource && !knows(record)) return;
        break;
      case Happening::kExecuted:
        refuse_unknown(record);
        break;
      case Happening::kCommitted:
        if (execution_.order.in_sequence) commit(record.time, workers[worker]);
        return;
      case Happening::kSettled:
      case Happening::kGvt:
        break;
      default:
        return;
    }
    workers[worker].push_back({record.what, record.lp, record.peer, record.time, record.version,
                               record.kind, record.slot});
  }

  models::RecordedExecution take() { return std::move(execution_); }

 private:
  // In sequence there is no GVT to tell of: what is committed are all events of a time.
  static void commit(kernel::VirtualTime time, std::vector<kernel::RecordedAct>& acts) {
    const kernel::VirtualTime next{time.t, time.round + 1};
    if (acts.empty() || acts.back().what != Happening::kGvt || acts.back().time != next)
      acts.push_back({Happening::kGvt, {}, {}, next});
  }

  // Of a run that ended early, the log does not hold what was to act later. Nor does it matter
  // unless a world has come there.
  bool knows(const TraceRecord& arrived) {
    const auto kind = static_cast<models::MessageKind>(arrived.kind);
    if (known_.contains({arrived.time.t, kind, arrived.slot})) return true;
    const auto [unknown, is_first] = unknown_.try_emplace(arrived.lp, arrived.time);
    if (!is_first) unknown->second = std::min(unknown->second, arrived.time);
    return false;
  }
  void refuse_unknown(const TraceRecord& executed) const {
    const auto unknown = unknown_.find(executed.lp);
    if (unknown == unknown_.end() || executed.time < unknown->second) return;
    throw UsageError(file_ + ": world " + std::to_string(kernel::index_of(executed.lp)) +
                     " had come to step " + std::to_string(unknown->second.t) +
                     ", for which something came from outside that the log does not hold: it ends "
                     "before");
  }

  const std::string file_;
  models::RecordedExecution execution_;
  std::set<std::tuple<std::int64_t, models::MessageKind, std::uint32_t>> known_;  // with slot
  std::map<kernel::LpId, kernel::VirtualTime> unknown_;                           // earliest
};

// Whether the next of the worker's happenings after the first `number` is a rollback, but for what
// it absorbs before.
bool rollback_follows(const RecordedWalk& walk, std::size_t number, std::uint32_t worker) {
  const auto next =
      std::find_if(walk.begin() + static_cast<std::ptrdiff_t>(number), walk.end(),
                   [worker](const WalkedHappening& walked) {
                     return walked.worker == worker && walked.record.what != Happening::kAbsorbed;
                   });
  return next != walk.end() && next->record.what == Happening::kRewound;
}

}  // namespace

models::RecordedExecution recorded_execution(LogReader& log, scenarios::Scenario& scenario) {
  const std::int64_t asked = asked_steps(log);
  if (!log.complete() || log.last_step() < asked)
    refuse_repetition(log, "is of a run that ended early: it cannot be had again as a whole");
  if (is_in_sequence(scenario))
    refuse_repetition(log,
                      "is of a run in sequence, which has one order only: soda replay has that "
                      "without --as-executed");
  scenario.run.steps = asked;
  Acts acts(log, scenario, changes_in(log, scenario));
  read_records(
      log, scenario.territory.worlds,
      [&acts](std::uint32_t worker, const TraceRecord& record) { acts.add(worker, record); });
  return acts.take();
}

std::vector<models::WorldStand> stands_as_executed(LogReader& log, scenarios::Scenario scenario,
                                                   const RecordedWalk& walk, std::size_t number) {
  Acts acts(log, scenario, changes_in(log, scenario));
  for (std::size_t i = 0; i < number; ++i) acts.add(walk[i].worker, walk[i].record);
  models::RecordedExecution execution = acts.take();
  execution.order.whole = false;
  // To look at what came late is to roll back: it is not had before the rollback is.
  std::vector<std::vector<kernel::RecordedAct>>& workers = execution.order.workers;
  for (std::uint32_t worker = 0; worker < workers.size(); ++worker)
    if (!workers[worker].empty() && workers[worker].back().what == Happening::kSettled &&
        rollback_follows(walk, number, worker))
      workers[worker].pop_back();
  scenario.run.steps = asked_steps(log);
  scenario.run.recorded = &execution;
  std::vector<models::WorldStand> stands;
  models::CommitObserver observer;
  observer.on_stand = [&stands](models::WorldStand stand) { stands.push_back(std::move(stand)); };
  const models::TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scenario.scene);
  models::simulate(scenario.scene, scenario.initial, map, scenario.run, observer);
  return stands;
}

std::optional<std::string> trace_divergence(LogReader& log, std::uint32_t worlds,
                                            std::span<const kernel::Bytes> chunks) {
  WorldHistories now(worlds);
  for (const kernel::Bytes& bytes : chunks) {
    kernel::TraceChunk chunk(bytes);
    for (TraceRecord record; chunk.next(record);) add_to_histories(record, now);
  }
  const std::vector<HistoryDifference> found = differences_of(histories_of(log, worlds), now);
  if (found.empty()) return std::nullopt;
  const HistoryDifference& first = found.front();
  return "world " + std::to_string(first.world) + ", happening " + std::to_string(first.happening) +
         ": logged: " + side_text(first.first) + "; now: " + side_text(first.second);
}

}  // namespace soda::analysis
