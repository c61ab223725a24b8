#include "models/world/island_advance.hpp"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "physics/integrators/free_flight.hpp"
#include "physics/model/joint.hpp"
#include "physics/step/advance_island.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;

// How many pairs of an island impacts have connected, in further passes.
std::int64_t connected_by_impacts(std::size_t island, const physics::StepScratch& scratch) {
  const physics::Islands& islands = scratch.islands;
  const std::span<const std::uint32_t> manifolds{islands.manifolds};
  const std::uint32_t first = islands.manifold_begin[island];
  const std::uint32_t last = islands.manifold_begin[island + 1];
  return std::ranges::count_if(manifolds.subspan(first, last - first), [&scratch](std::uint32_t m) {
    return is_link(scratch.manifolds[m]) && !is_joint(scratch.manifolds[m]);
  });
}

}  // namespace

// Own bodies and foreign nodes side by side.
bool IslandAdvance::advance_known_islands(kernel::VirtualTime now, Bag bag) {
  physics::StepScratch& scratch = step_.scratch;
  std::vector<Node>& nodes = step_.merge.nodes;
  const KnownBodies known = step_.known_bodies();
  const bool only_own = nodes.empty();
  std::vector<BodyState> with_foreign;
  if (!only_own) {
    with_foreign.reserve(known.ids.size());
    for (const std::int32_t place : known.place)
      with_foreign.push_back(place >= 0 ? std::move(step_.states[place]) : nodes[-1 - place].state);
  }
  const std::span<BodyState> states = only_own ? step_.states : with_foreign;
  physics::build_islands(known.ids, scratch.manifolds, scratch.islands);
  if (pass_of(now) == 0) step_.memo.islands.assign(step_.remembers ? step_.ids.size() : 0, {});
  bool any = false;
  for (std::size_t island = 0; island < scratch.islands.count(); ++island)
    any = advance_island(now, bag, island, known, states) || any;
  for (std::size_t body = 0; !only_own && body < known.ids.size(); ++body) {
    if (known.place[body] >= 0) step_.states[known.place[body]] = std::move(states[body]);
  }
  return any;
}

// If it has an own body, and has not been advanced as it is now. Whether it was.
bool IslandAdvance::advance_island(kernel::VirtualTime now, Bag bag, std::size_t island,
                                   const KnownBodies& known, std::span<BodyState> states) {
  physics::StepScratch& scratch = step_.scratch;
  const physics::Islands& islands = scratch.islands;
  const std::span<const std::uint32_t> bodies = islands.bodies_of(island);
  const std::size_t manifolds = islands.manifold_begin[island + 1] - islands.manifold_begin[island];
  const auto is_own = [&](std::uint32_t body) { return known.place[body] >= 0; };
  const auto own = std::ranges::count_if(bodies, is_own);
  if (own == 0) return false;
  const std::uint32_t first_own = *std::ranges::find_if(bodies, is_own);
  if (!scratch.passes.is_new(static_cast<std::uint32_t>(known.place[first_own]), manifolds))
    return false;
  // Each pass connects somebody new. Of an island with fewer connections not all is known: it would
  // send bodies on in answer to what is taken back by now, and so round a cycle of worlds for ever.
  const std::uint32_t pass = pass_of(now);
  if (connected_by_impacts(island, scratch) < std::int64_t{pass}) return false;
  ++step_.solves;
  physics::gather_island(island, known.ids, states, scratch);
  begin_pass(bodies, manifolds, pass, known);
  const bool mixed = own != std::ssize(bodies);
  if (mixed && pass == 0) note_owners(bodies, known);
  if (!mixed)
    advance_own_island(pass);
  else if (pass > 0 || !splits_.take(bag))
    advance_mixed_island(now.t, known.owners[bodies.front()]);
  if (step_.remembers && pass == 0) remember_island(bodies, known, mixed);
  extrapolation_.note_solved(bodies, known);
  end_pass(bodies, known);
  physics::scatter_island(island, states, scratch);
  return true;
}

// The gathered island starts where the step did; what an earlier pass has told of it is void.
void IslandAdvance::begin_pass(std::span<const std::uint32_t> bodies, std::size_t manifolds,
                               std::uint32_t pass, const KnownBodies& known) {
  physics::StepScratch& scratch = step_.scratch;
  const BodyId linked = physics::linked_label(scratch.island_ids, scratch.island_manifolds);
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (const std::int32_t place = known.place[bodies[i]]; place >= 0)
      scratch.passes.begin(static_cast<std::uint32_t>(place), manifolds, linked,
                           scratch.island_states[i]);
  if (pass == 0) return;
  for (const std::uint32_t body : bodies)
    if (step_.remembers && known.place[body] >= 0)
      step_.memo.islands[static_cast<std::size_t>(known.place[body])] = {};
  ++step_.work.stages.islands_again;
  physics::forget_reports(scratch.island_ids, step_.report);
  extrapolation_.forget_solved();
}

void IslandAdvance::end_pass(std::span<const std::uint32_t> bodies, const KnownBodies& known) {
  physics::StepScratch& scratch = step_.scratch;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (const std::int32_t place = known.place[bodies[i]]; place >= 0)
      scratch.passes.end(*step_.rules.scene, step_.around.geometry, scratch.island_ids[i],
                         static_cast<std::uint32_t>(place), scratch.island_states[i],
                         &scratch.boxes[static_cast<std::size_t>(place)]);
}

void IslandAdvance::note_owners(std::span<const std::uint32_t> bodies, const KnownBodies& known) {
  if (!waits_.are_on()) return;
  std::vector<WorldId> owners;
  for (const std::uint32_t body : bodies) owners.push_back(known.owners[body]);
  waits_.note_island(step_.scratch.island_ids, owners);
}

// The paper's constraint-solver rollback.
void IslandAdvance::start_warm() {
  if (step_.around.rollback != RollbackMode::kWarm) return;
  step_.work.worlds.islands_warm +=
      step_.repetition.take_impulses(step_.scratch.island_ids, step_.scratch.island_states);
}

physics::IslandReport IslandAdvance::advance_gathered(physics::StageCounters& work,
                                                      std::vector<physics::AdvanceFault>& faults) {
  physics::StepScratch& scratch = step_.scratch;
  return physics::advance_island(physics::whole_step(*step_.rules.scene, step_.around.geometry,
                                                     scratch.island_ids, scratch.island_manifolds),
                                 scratch.island_states, {scratch.solve, work, faults});
}

void IslandAdvance::advance_own_island(std::uint32_t pass) {
  physics::StepScratch& scratch = step_.scratch;
  physics::IslandReport report;
  const bool taken =
      pass == 0 && step_.repetition.take_island(scratch.island_ids, scratch.island_states, &report);
  if (!taken && (pass > 0 || !take_resting(report))) {
    start_warm();
    report = advance_gathered(step_.work.stages, step_.report.faults);
    if (report.rests && pass == 0)
      scratch.resting.keep(scratch.island_ids, scratch.island_manifolds, scratch.island_states,
                           report);
  }
  step_.report.islands.push_back(report);
  step_.count_repetition(taken, scratch.island_ids.size());
}

bool IslandAdvance::take_resting(physics::IslandReport& report) {
  const physics::IslandReport* const known =
      step_.scratch.resting.take_island(step_.scratch.island_ids);
  if (known == nullptr) return false;
  report = *known;
  ++step_.work.stages.islands_at_rest;
  return true;
}

// Own ones, except those that a repetition takes over.
void IslandAdvance::advance_free_bodies() {
  std::vector<std::uint32_t> free;
  for (std::uint32_t body = 0; body < step_.ids.size(); ++body) {
    if (!step_.scratch.passes.is_free(body)) continue;
    const BodyId id = step_.ids[body];
    if (step_.remembers) step_.memo.islands[body] = {id, 1};
    const bool taken = step_.repetition.take_island({&id, 1}, {&step_.states[body], 1}, nullptr);
    step_.count_repetition(taken, 1);
    if (!taken) free.push_back(body);
  }
  physics::advance_free_bodies(
      physics::whole_step(*step_.rules.scene, step_.around.geometry, step_.ids, {}), free,
      step_.states, step_.work.stages, step_.report.faults);
}

void IslandAdvance::remember_island(std::span<const std::uint32_t> bodies, const KnownBodies& known,
                                    bool mixed) {
  const StepMemo::Membership membership{known.ids[bodies.front()],
                                        mixed ? 0 : static_cast<std::uint32_t>(bodies.size())};
  for (const std::uint32_t body : bodies) {
    const std::int32_t place = known.place[body];
    if (place >= 0) step_.memo.islands[static_cast<std::size_t>(place)] = membership;
  }
}

// Of the worlds in one process, the first to come solves; the others find its solution. The owner
// of the label reports the island, and its process is the one whose solve is not done elsewhere.
void IslandAdvance::advance_mixed_island(std::int64_t step, WorldId label_owner) {
  const WorldSurroundings& around = step_.around;
  physics::StepScratch& scratch = step_.scratch;
  ++step_.work.worlds.mixed_islands;
  start_warm();
  kernel::Bytes input;
  encode_island(scratch.island_ids, scratch.island_manifolds, scratch.island_states, input);
  if (!step_.rules.inputs->changes.empty())
    encode_changeable(*step_.rules.scene, scratch.island_ids, scratch.island_manifolds, input);
  std::shared_ptr<const SolvedIsland> solved = around.solves.find(input);
  const bool is_fresh = solved == nullptr;
  if (solved) {
    ++step_.work.worlds.islands_reused;
  } else {
    auto fresh = std::make_shared<SolvedIsland>();
    physics::StageCounters work;
    fresh->report = advance_gathered(work, fresh->faults);
    step_.work.stages += work;
    const auto process_of = [&around](WorldId world) {
      return around.processes.owner_of(kernel::LpId{index_of(world)});
    };
    if (process_of(label_owner) != process_of(step_.self)) step_.work.replicated += work;
    fresh->states = scratch.island_states;
    solved = fresh;
    around.solves.store(step, std::move(input), std::move(fresh));
  }
  step_.count_repetition(!is_fresh, scratch.island_ids.size());
  scratch.island_states = solved->states;
  physics::StepReport& report = step_.report;
  if (label_owner == step_.self) report.islands.push_back(solved->report);
  report.faults.insert(report.faults.end(), solved->faults.begin(), solved->faults.end());
}

}  // namespace soda::models
