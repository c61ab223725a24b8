// Giant islands that several worlds solve together (split_solve.hpp).
#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "models/world/world.hpp"
#include "physics/constraints/ways.hpp"
#include "physics/events/one_solve.hpp"
#include "physics/model/body_places.hpp"

namespace soda::models {

using physics::BodyId;

// Whether there can be a giant island with foreign bodies.
bool World::may_split() const {
  if (around_.processors.empty() || merge_.nodes.empty()) return false;
  return physics::is_giant(scratch_.manifolds);
}

void World::start_splits() {
  splits_.clear();
  const KnownBodies known = known_bodies(ids_, id_, merge_);
  physics::build_islands(known.ids, scratch_.manifolds, scratch_.islands);
  for (std::size_t island = 0; island < scratch_.islands.count(); ++island)
    consider_split(island, known);
}

void World::consider_split(std::size_t index, const KnownBodies& known) {
  const physics::Islands& islands = scratch_.islands;
  SplitIsland island;
  for (std::uint32_t i = islands.body_begin[index]; i < islands.body_begin[index + 1]; ++i) {
    const std::uint32_t body = islands.bodies[i];
    island.ids.push_back(known.ids[body]);
    island.owners.push_back(known.owners[body]);
  }
  if (std::find(island.owners.begin(), island.owners.end(), id_) == island.owners.end()) return;
  for (std::uint32_t i = islands.manifold_begin[index]; i < islands.manifold_begin[index + 1]; ++i)
    island.manifolds.push_back(scratch_.manifolds[islands.manifolds[i]]);
  if (!physics::is_giant(island.manifolds)) return;
  for (std::uint32_t i = islands.body_begin[index]; i < islands.body_begin[index + 1]; ++i) {
    const std::int32_t place = known.place[islands.bodies[i]];
    island.states.push_back(place >= 0 ? states_[static_cast<std::size_t>(place)]
                                       : merge_.nodes[static_cast<std::size_t>(-1 - place)].state);
  }
  std::optional<physics::IslandBlocks> blocks = physics::blocks_of_step(
      physics::whole_step(*rules_.scene, around_.geometry, island.ids, island.manifolds),
      island.states);
  if (!blocks) return;
  std::optional<SplitPlan> plan =
      plan_split(*rules_.scene, std::move(*blocks), island.owners, island.manifolds,
                 around_.processors, around_.exchange_ns);
  if (!plan) return;
  encode_island(island.ids, island.manifolds, island.states, island.input);
  if (!rules_.inputs->changes.empty())
    encode_changeable(*rules_.scene, island.ids, island.manifolds, island.input);
  island.scene = rules_.scene;
  splits_.push_back(std::make_unique<SplitSolve>(std::move(island), std::move(*plan), id_));
}

// One round of all giant islands at once. Letters of a world that knows an island otherwise can
// come at any time, and mean nothing here.
void World::split(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) {
  if (now != next_) return;
  const std::uint32_t round = merge_round_of(now);
  if (round == 0) start_splits();
  bool goes_on = false;
  std::vector<SplitSolve::Letter> letters;
  for (const std::unique_ptr<SplitSolve>& split : splits_) {
    split->round(now.t, round, bag, around_.solves, stages_, letters);
    goes_on = goes_on || (split->solves() && !split->is_done());
    if (!split->is_done()) continue;
    for (SplitSolve::Letter& letter : split->outcome_letters())
      send(letter.to, time_of(now.t, Phase::kSolve), letter.kind, std::move(letter.payload),
           outbox);
  }
  for (SplitSolve::Letter& letter : letters)
    send(letter.to, time_of(now.t, Phase::kSplit, round + 1), letter.kind,
         std::move(letter.payload), outbox);
  next_ = goes_on ? time_of(now.t, Phase::kSplit, round + 1) : time_of(now.t, Phase::kSolve);
}

// Fills in how the own bodies of the gathered island ended, if it was split and all has been heard.
bool World::take_split(Bag bag) {
  const auto split = std::find_if(splits_.begin(), splits_.end(), [this](const auto& candidate) {
    return candidate->name().label == scratch_.island_ids.front();
  });
  if (split == splits_.end()) return false;
  const std::optional<SplitSolve::Heard> heard = (*split)->outcome(bag);
  if (!heard) {
    ++counters_.splits_given_up;
    return false;
  }
  ++counters_.mixed_islands;
  ++counters_.islands_split;
  const physics::SceneDescription& scene = *rules_.scene;
  physics::WayBounds bounds;
  physics::bound_ways(scene, scene.dt_s, scratch_.island_ids, (*split)->island().manifolds,
                      scratch_.island_states, bounds);
  for (const BlockNews::Moved& moved : heard->bodies) {
    const std::size_t place = physics::place_of(scratch_.island_ids, moved.id);
    scratch_.island_states[place] = moved.state;
    physics::report_impossible_way(scene, bounds, place, moved.id, moved.state, report_.faults);
  }
  if (heard->report) report_.islands.push_back(*heard->report);
  report_.faults.insert(report_.faults.end(), heard->faults.begin(), heard->faults.end());
  count_repetition(!(*split)->has_computed(), scratch_.island_ids.size());
  return true;
}

}  // namespace soda::models
