#include "analysis/trace/recorded_order.hpp"

#include <algorithm>
#include <utility>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/trace/trace_comparison.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;

void refuse_repetition(const LogReader& log, const std::string& why) {
  throw UsageError(log.file() + " " + why +
                   ": it cannot be had again as it was executed (soda replay --interactive walks "
                   "through its trace)");
}

void refuse_what_is_not_repeated(const LogReader& log, const scenarios::Scenario& scenario) {
  if (scenario.run.inputs.any()) refuse_repetition(log, "is of a run with user input");
  if (scenario.run.balancing.policy != models::BalancingPolicy::kOff)
    refuse_repetition(log, "is of a run with balancing");
  if (scenario.territory.worlds == 1 || scenario.run.executor == models::ExecutorKind::kSequential)
    refuse_repetition(log, "is of a run in sequence");
}

// If it is an act; the rest follows from those.
void add_act(std::uint32_t worker, const TraceRecord& record, kernel::RecordedOrder& order) {
  if (worker >= order.size()) order.resize(worker + 1);
  if (record.what == Happening::kArrived || record.what == Happening::kSettled ||
      record.what == Happening::kExecuted || record.what == Happening::kGvt)
    order[worker].push_back({record.what, record.lp, record.peer, record.time, record.incarnation});
}

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

kernel::RecordedOrder recorded_order(LogReader& log, scenarios::Scenario& scenario) {
  const std::int64_t asked = asked_steps(log);
  if (!log.complete() || log.last_step() < asked)
    refuse_repetition(log, "is of a run that ended early");
  refuse_what_is_not_repeated(log, scenario);
  scenario.run.steps = asked;
  kernel::RecordedOrder order;
  read_records(log, scenario.territory.worlds,
               [&order](std::uint32_t worker, const TraceRecord& record) {
                 add_act(worker, record, order);
               });
  return order;
}

std::vector<models::WorldStand> stands_as_executed(LogReader& log, scenarios::Scenario scenario,
                                                   const RecordedWalk& walk, std::size_t number) {
  refuse_what_is_not_repeated(log, scenario);
  kernel::RecordedOrder order;
  for (std::size_t i = 0; i < number; ++i) add_act(walk[i].worker, walk[i].record, order);
  // To look at what came late is to roll back: it is not had before the rollback is.
  for (std::uint32_t worker = 0; worker < order.size(); ++worker)
    if (!order[worker].empty() && order[worker].back().what == Happening::kSettled &&
        rollback_follows(walk, number, worker))
      order[worker].pop_back();
  scenario.run.steps = asked_steps(log);
  scenario.run.recorded = &order;
  scenario.run.recorded_whole = false;
  scenario.run.recorded_over_ranks = log.options().ranks > 1;
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
