#include "models/world/split_islands.hpp"

#include <algorithm>
#include <utility>

#include "kernel/api/hash_mix.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/events/one_solve.hpp"
#include "physics/model/body_places.hpp"

namespace soda::models {

using physics::BodyId;

bool SplitIslands::may_split() const {
  if (step_.around.processors.empty() || step_.merge.nodes.empty()) return false;
  return physics::is_large(step_.scratch.manifolds);
}

void SplitIslands::find() {
  splits_.clear();
  const KnownBodies known = step_.known_bodies();
  physics::Islands& islands = step_.scratch.islands;
  physics::build_islands(known.ids, step_.scratch.manifolds, islands);
  for (std::size_t island = 0; island < islands.count(); ++island) consider(island, known);
}

void SplitIslands::consider(std::size_t index, const KnownBodies& known) {
  const physics::SceneDescription& scene = *step_.rules.scene;
  const physics::Islands& islands = step_.scratch.islands;
  SplitIsland island;
  for (std::uint32_t i = islands.body_begin[index]; i < islands.body_begin[index + 1]; ++i) {
    const std::uint32_t body = islands.bodies[i];
    island.ids.push_back(known.ids[body]);
    island.owners.push_back(known.owners[body]);
  }
  if (std::find(island.owners.begin(), island.owners.end(), step_.self) == island.owners.end())
    return;
  for (std::uint32_t i = islands.manifold_begin[index]; i < islands.manifold_begin[index + 1]; ++i)
    island.manifolds.push_back(step_.scratch.manifolds[islands.manifolds[i]]);
  if (!physics::is_large(island.manifolds)) return;
  for (std::uint32_t i = islands.body_begin[index]; i < islands.body_begin[index + 1]; ++i) {
    const std::int32_t place = known.place[islands.bodies[i]];
    island.states.push_back(place >= 0
                                ? step_.states[static_cast<std::size_t>(place)]
                                : step_.merge.nodes[static_cast<std::size_t>(-1 - place)].state);
  }
  std::optional<physics::IslandBlocks> blocks = physics::blocks_of_step(
      physics::whole_step(scene, step_.around.geometry, island.ids, island.manifolds),
      island.states);
  if (!blocks) return;
  std::optional<SplitPlan> plan =
      plan_split(scene, std::move(*blocks), island.owners, island.manifolds,
                 step_.around.processors, step_.around.exchange_ns);
  if (!plan) return;
  encode_island(island.ids, island.manifolds, island.states, island.input);
  if (!step_.rules.inputs->changes.empty())
    encode_changeable(scene, island.ids, island.manifolds, island.input);
  island.scene = step_.rules.scene;
  splits_.push_back(std::make_unique<SplitSolve>(std::move(island), std::move(*plan), step_.self));
}

bool SplitIslands::round(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  const std::uint32_t round = merge_round_of(now);
  if (round == 0) find();
  bool goes_on = false;
  std::vector<SplitSolve::Letter> letters;
  for (const std::unique_ptr<SplitSolve>& split : splits_) {
    split->round(now.t, round, bag, step_.around.solves, step_.work.stages, letters);
    goes_on = goes_on || (split->solves() && !split->is_done());
    if (!split->is_done()) continue;
    for (SplitSolve::Letter& letter : split->outcome_letters())
      out.send(letter.to, time_of(now.t, Phase::kSolve), letter.kind, std::move(letter.payload));
  }
  for (SplitSolve::Letter& letter : letters)
    out.send(letter.to, time_of(now.t, Phase::kSplit, round + 1), letter.kind,
             std::move(letter.payload));
  return goes_on;
}

bool SplitIslands::take(Bag bag) {
  const std::vector<BodyId>& ids = step_.scratch.island_ids;
  std::vector<physics::BodyState>& states = step_.scratch.island_states;
  const auto split = std::find_if(splits_.begin(), splits_.end(), [&ids](const auto& candidate) {
    return candidate->name().label == ids.front();
  });
  if (split == splits_.end()) return false;
  const std::optional<SplitSolve::Received> received = (*split)->outcome(bag);
  if (!received) {
    ++step_.work.worlds.splits_given_up;
    return false;
  }
  ++step_.work.worlds.mixed_islands;
  ++step_.work.worlds.islands_split;
  const physics::SceneDescription& scene = *step_.rules.scene;
  physics::DisplacementBounds bounds;
  physics::bound_displacements(scene, scene.dt_s, ids, (*split)->island().manifolds, states,
                               bounds);
  physics::StepReport& report = step_.report;
  for (const BlockNews::Moved& moved : received->bodies) {
    const std::size_t place = physics::place_of(ids, moved.id);
    states[place] = moved.state;
    physics::report_impossible_displacement(scene, bounds, place, moved.id, moved.state,
                                            report.faults);
  }
  if (received->report) report.islands.push_back(*received->report);
  report.faults.insert(report.faults.end(), received->faults.begin(), received->faults.end());
  step_.count_repetition(!(*split)->has_computed(), ids.size());
  return true;
}

bool SplitIslands::lack_news(Bag bag) const {
  return std::ranges::any_of(splits_, [bag](const auto& split) { return split->lacks_news(bag); });
}

bool SplitIslands::lack_outcome(Bag bag) const {
  return std::ranges::any_of(splits_,
                             [bag](const auto& split) { return split->lacks_outcome(bag); });
}

std::uint64_t SplitIslands::digest(std::uint64_t digest) const {
  for (const std::unique_ptr<SplitSolve>& split : splits_)
    digest = kernel::append(digest, split->digest());
  return digest;
}

}  // namespace soda::models
