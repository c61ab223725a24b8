#include "models/commit/commit_merge.hpp"

#include <algorithm>

namespace soda::models {

CommitMerge::CommitMerge(const CommitObserver& observer, std::uint32_t worlds,
                         std::int64_t first_step)
    : observer_(observer), worlds_(worlds), committed_steps_(first_step) {}

void CommitMerge::add(WorldId world, const BufferEntry& entry) {
  const std::lock_guard lock(mutex_);
  if (worlds_ == 1) {  // nothing to join: no copy
    ++committed_steps_;
    islands_ += entry.islands.size();
    if (!observer_.on_step) return;
    CommittedStep step{.step = entry.step,
                       .ids = {},
                       .states = {},
                       .owners = {},
                       .islands = entry.islands,
                       .inputs = {},
                       .territory_changes = {}};
    std::vector<WorldId> owners;
    if (wants_states(entry.step)) {
      owners.assign(entry.ids.size(), world);
      step.ids = entry.ids;
      step.states = entry.states;
      step.owners = owners;
    }
    observer_.on_step(step);
    return;
  }
  Pending& pending = pending_[entry.step];
  ++pending.worlds;
  if (wants_states(entry.step)) pending.parts.push_back({world, entry.ids, entry.states});
  pending.islands.insert(pending.islands.end(), entry.islands.begin(), entry.islands.end());
  // Worlds commit their own steps in order, so steps become whole in order too.
  if (pending.worlds == worlds_) {
    Pending whole = std::move(pending);
    pending_.erase(entry.step);
    deliver(entry.step, std::move(whole));
  }
}

void CommitMerge::deliver(std::int64_t step, Pending pending) {
  ++committed_steps_;
  islands_ += pending.islands.size();
  if (!observer_.on_step) return;
  std::sort(pending.islands.begin(), pending.islands.end(),
            [](const auto& a, const auto& b) { return a.label < b.label; });
  struct Place {
    physics::BodyId id;
    std::uint32_t part, index;
  };
  std::vector<Place> order;
  for (std::uint32_t part = 0; part < pending.parts.size(); ++part)
    for (std::uint32_t i = 0; i < pending.parts[part].ids.size(); ++i)
      order.push_back({pending.parts[part].ids[i], part, i});
  std::sort(order.begin(), order.end(), [](const Place& a, const Place& b) { return a.id < b.id; });
  std::vector<physics::BodyId> ids;
  std::vector<physics::BodyState> states;
  std::vector<WorldId> owners;
  for (const Place& place : order) {
    ids.push_back(place.id);
    states.push_back(std::move(pending.parts[place.part].states[place.index]));
    owners.push_back(pending.parts[place.part].world);
  }
  observer_.on_step({.step = step,
                     .ids = ids,
                     .states = states,
                     .owners = owners,
                     .islands = pending.islands,
                     .inputs = {},
                     .territory_changes = {}});
}

}  // namespace soda::models
