#include "models/run/recorded_run.hpp"

#include <algorithm>
#include <utility>

#include "models/load_balancing/balancing.hpp"
#include "models/messages/messages.hpp"
#include "models/messages/schedule.hpp"
#include "models/user_input/input_feed.hpp"
#include "models/world/world.hpp"

namespace soda::models {
namespace {

// One decision of the balancer holds from a step.
std::vector<kernel::Message> external_messages(const RunOptions& options, std::uint32_t worlds) {
  std::vector<kernel::Message> all;
  for (const UserInput& input : options.inputs.script)
    append_for_all(input_message(input), worlds, all);
  std::span<const TerritoryChange> left = options.recorded->territory_changes;
  while (!left.empty()) {
    const std::int64_t step = left.front().step;
    std::vector<CellTransfer> transfers;
    for (; !left.empty() && left.front().step == step; left = left.subspan(1))
      transfers.push_back({left.front().cell, left.front().to});
    append_for_all(transfer_message(step, transfers), worlds, all);
  }
  return all;
}

void tell_stands(std::span<const std::unique_ptr<kernel::LogicalProcess>> worlds,
                 const CommitObserver& observer) {
  if (!observer.on_stand) return;
  BufferEntry copy;
  for (std::uint32_t id = 0; id < worlds.size(); ++id) {
    const BufferEntry& entry = static_cast<World&>(*worlds[id]).newest_entry(copy);
    observer.on_stand({WorldId{id}, entry.step, entry.ids, entry.states});
  }
}

}  // namespace

kernel::RunResult run_recorded(std::span<const std::unique_ptr<kernel::LogicalProcess>> worlds,
                               const RunOptions& options, const kernel::Recording& recording,
                               const CommitObserver& observer) {
  const kernel::RecordedOrder& order = options.recorded->order;
  kernel::RunResult outcome = kernel::run_as_recorded(
      worlds, time_of(options.steps, Phase::kBegin), order,
      external_messages(options, static_cast<std::uint32_t>(worlds.size())), recording);
  if (!order.whole) tell_stands(worlds, observer);
  return outcome;
}

std::vector<TerritoryChange> changes_at(std::span<const TerritoryChange> changes,
                                        std::int64_t step) {
  return {std::ranges::lower_bound(changes, step, {}, &TerritoryChange::step),
          std::ranges::upper_bound(changes, step, {}, &TerritoryChange::step)};
}

}  // namespace soda::models
