#include "physics/step/sleeping_islands.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "physics/model/contact_manifold.hpp"

namespace soda::physics {
namespace {

// Of `id` among `ids`, or their number. In an undivided scene bodies stand at their numbers.
std::size_t place_of(BodyId id, std::span<const BodyId> ids) {
  const std::size_t guess = index_of(id);
  if (guess < ids.size() && ids[guess] == id) return guess;
  const auto at = std::lower_bound(ids.begin(), ids.end(), id);
  return at != ids.end() && *at == id ? static_cast<std::size_t>(at - ids.begin()) : ids.size();
}

}  // namespace

void SleepingIslands::start(std::span<const BodyId> ids, std::span<const BodyState> states) {
  held_.clear();
  kept_.clear();
  if (islands_.empty()) return;
  ids_ = ids;
  held_.resize(ids.size());
  for (Island& island : islands_) {
    island.held = 0;
    island.met = false;
    for (std::uint32_t k = 0; k < island.ids.size(); ++k) {
      const std::size_t place = place_of(island.ids[k], ids);
      if (place == ids.size() || !identical(states[place], island.states[k])) continue;
      held_[place] = {&island, k};
      ++island.held;
    }
  }
}

SleepingIslands::Held SleepingIslands::find(BodyId id) const {
  const std::size_t place = place_of(id, ids_);
  return place == ids_.size() ? Held{} : held_[place];
}

bool SleepingIslands::take_known_contacts(BodyId a, BodyId b,
                                          std::vector<ContactManifold>& manifolds) const {
  const Held first = find(a);
  if (first.island == nullptr) return false;
  if (!is_static(b) && find(b).island == nullptr) return false;
  const Island& island = *first.island;
  for (std::uint32_t i = island.begin[first.body]; i < island.begin[first.body + 1]; ++i)
    if (island.manifolds[i].b == b) manifolds.push_back(island.manifolds[i]);
  return true;
}

const IslandReport* SleepingIslands::take_island(std::span<const BodyId> ids) {
  if (!knows_any()) return nullptr;
  Island* const island = find(ids.front()).island;
  if (island == nullptr || island->held != ids.size() || !std::ranges::equal(ids, island->ids))
    return nullptr;
  island->met = true;
  return &island->report;
}

void SleepingIslands::keep(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                           std::span<const BodyState> states, const IslandReport& report) {
  Island island{{ids.begin(), ids.end()},
                {states.begin(), states.end()},
                {manifolds.begin(), manifolds.end()},
                {},
                report};
  island.begin.reserve(ids.size() + 1);
  std::uint32_t next = 0;
  for (const BodyId id : ids) {
    island.begin.push_back(next);
    while (next < manifolds.size() && manifolds[next].a == id) ++next;
  }
  island.begin.push_back(next);
  kept_.push_back(std::move(island));
}

void SleepingIslands::finish() {
  std::erase_if(islands_, [](const Island& island) { return !island.met; });
  std::ranges::move(kept_, std::back_inserter(islands_));
  kept_.clear();
  held_.clear();
}

void SleepingIslands::forget() {
  islands_.clear();
  kept_.clear();
  held_.clear();
}

}  // namespace soda::physics
