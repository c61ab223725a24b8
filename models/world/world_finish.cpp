// The last phases of a step: islands are solved, then own bodies advanced and the next entry
// written.
#include <algorithm>
#include <map>
#include <span>
#include <utility>

#include "models/world/world.hpp"
#include "physics/integrators/free_flight.hpp"
#include "physics/model/joint.hpp"
#include "physics/step/advance_island.hpp"

namespace soda::models {

using physics::BodyId;
using physics::BodyState;

namespace {

// How many pairs of an island hits have connected, in further passes.
std::int64_t connected_by_hits(std::size_t island, const physics::StepScratch& scratch) {
  const physics::Islands& islands = scratch.islands;
  const std::span<const std::uint32_t> manifolds{islands.manifolds};
  const std::uint32_t first = islands.manifold_begin[island];
  const std::uint32_t last = islands.manifold_begin[island + 1];
  return std::ranges::count_if(manifolds.subspan(first, last - first), [&scratch](std::uint32_t m) {
    return is_link(scratch.manifolds[m]) && !is_joint(scratch.manifolds[m]);
  });
}

}  // namespace

// Does not wait for foreign news: what comes later is a straggler.
void World::solve(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) {
  if (pass_of(now) == 0) scratch_.passes.start(ids_.size());
  const bool advanced = advance_known_islands(now, bag);
  // Warm solves depend on the rollbacks before, and what others are told within a step must not.
  const bool sends = around_.rollback != RollbackMode::kWarm &&
                     (!scratch_.passes.ever_sent().empty() || !sent_.empty());
  if (sends) send_sent(now, outbox);
  next_ = advanced && sends ? time_of(now.t, Phase::kPairs, 0, pass_of(now) + 1)
                            : time_of(now.t, Phase::kFinish);
}

// Bodies without contact move, the entry of the next step is written.
void World::finish(std::int64_t step, kernel::Outbox& outbox) {
  if (divided()) {
    scratch_.resting.finish();
    std::ranges::sort(report_.islands, {}, &physics::IslandReport::label);
    advance_free_bodies();
  } else {
    physics::advance_bodies(*rules_.scene, around_.geometry, ids_, states_,
                            {scratch_, report_, stages_});
    solves_ = static_cast<std::uint32_t>(report_.islands.size());
  }
  report_faults(outbox);
  const bool somebody_leaves = divided() && send_migrants(step, outbox);
  if (!keeps_history_) buffer_.forget(step);
  write_entry(step, somebody_leaves, outbox);
  tell_newest();
  next_ = time_of(step + 1, Phase::kBegin);
}

void World::write_entry(std::int64_t step, bool somebody_leaves, kernel::Outbox& outbox) {
  std::vector<BodyId> differs = repetition_.differences(ids_, states_);
  for (const WorldId partner : concerned(next_gate_, id_, differs))
    outbox.withdraw(kernel::LpId{index_of(partner)});
  memo_.valid = memo_.valid && report_.faults.empty();
  const StoredEntry* const stale = buffer_.stale_next();
  const bool differs_now =
      stale != nullptr && (stale->frame_differs || !has_ids(*stale, ids_) ||
                           stale->gate.items().front() != next_gate_ ||
                           rules_of(*stale) != rules_ || !(view_of(*stale) == next_view_));
  const std::int64_t spent_before = stale != nullptr ? stale->spent_ns : 0;
  buffer_.differs(step).clear();
  buffer_.frame_differs(step) = false;
  BufferEntry& entry = buffer_.append();
  entry.frame_differs = differs_now || (stale != nullptr && !buffer_.has_stale());
  if (around_.sampling.interval > 0) entry.spent_ns = spent_since_last_entry() + spent_before;
  std::swap(entry.ids, ids_);
  std::swap(entry.states, states_);
  std::swap(entry.islands, report_.islands);
  std::swap(entry.memo, memo_);
  entry.solves = solves_;
  std::swap(entry.gate, next_gate_);
  std::swap(entry.view, next_view_);
  entry.rules = rules_;
  entry.may_leave = somebody_leaves;
  std::swap(entry.differs, differs);
  // Now, while the states are in the cache: before the next step others are executed.
  if (keeps_history_) buffer_.store_open(counters_);
}

std::int64_t World::spent_since_last_entry() {
  const WorkReading before = std::exchange(work_at_entry_, work());
  return work_cost(before, work_at_entry_, kernel::Synchronisation::kOptimistic).sum_ns();
}

// Own bodies and foreign nodes side by side. Every participating world solves the whole of a mixed
// island in canonical order and keeps its own bodies: same bits, no message back. Giant ones may
// have been split between worlds before. Whether there are any that have not been solved.
bool World::advance_known_islands(kernel::VirtualTime now, Bag bag) {
  const KnownBodies known = known_bodies(ids_, id_, merge_);
  const bool only_own = merge_.nodes.empty();
  std::vector<BodyState> with_foreign;
  if (!only_own) {
    with_foreign.reserve(known.ids.size());
    for (const std::int32_t place : known.place)
      with_foreign.push_back(place >= 0 ? std::move(states_[place])
                                        : merge_.nodes[-1 - place].state);
  }
  const std::span<BodyState> states = only_own ? states_ : with_foreign;
  physics::build_islands(known.ids, scratch_.manifolds, scratch_.islands);
  if (pass_of(now) == 0) memo_.islands.assign(remembers() ? ids_.size() : 0, {});
  bool any = false;
  for (std::size_t island = 0; island < scratch_.islands.count(); ++island)
    any = advance_island(now, bag, island, known, states) || any;
  for (std::size_t body = 0; !only_own && body < known.ids.size(); ++body) {
    if (known.place[body] >= 0) states_[known.place[body]] = std::move(states[body]);
  }
  return any;
}

// If it has an own body, and has not been advanced as it is now. Whether it was.
bool World::advance_island(kernel::VirtualTime now, Bag bag, std::size_t island,
                           const KnownBodies& known, std::span<BodyState> states) {
  const physics::Islands& islands = scratch_.islands;
  const std::span<const std::uint32_t> bodies = islands.bodies_of(island);
  const std::size_t manifolds = islands.manifold_begin[island + 1] - islands.manifold_begin[island];
  const auto is_own = [&](std::uint32_t body) { return known.place[body] >= 0; };
  const auto own = std::ranges::count_if(bodies, is_own);
  if (own == 0) return false;
  const std::uint32_t first_own = *std::ranges::find_if(bodies, is_own);
  if (!scratch_.passes.is_new(static_cast<std::uint32_t>(known.place[first_own]), manifolds))
    return false;
  // Each pass connects somebody new. Of an island with fewer connections not all is known: it would
  // send bodies on in answer to what is taken back by now, and so round a cycle of worlds for ever.
  if (connected_by_hits(island, scratch_) < std::int64_t{pass_of(now)}) return false;
  ++solves_;
  physics::gather_island(island, known.ids, states, scratch_);
  begin_pass(bodies, manifolds, pass_of(now), known);
  const bool mixed = own != std::ssize(bodies);
  if (mixed && pass_of(now) == 0) note_owners(island, known);
  if (!mixed)
    advance_own_island(pass_of(now));
  else if (pass_of(now) > 0 || !take_split(bag))
    advance_mixed_island(now.t, known.owners[bodies.front()]);
  if (remembers() && pass_of(now) == 0) remember_island(island, known, mixed);
  note_known(bodies, known);
  end_pass(bodies, known);
  physics::scatter_island(island, states, scratch_);
  return true;
}

// The gathered island starts where the step did; what an earlier pass has told of it is void.
void World::begin_pass(std::span<const std::uint32_t> bodies, std::size_t manifolds,
                       std::uint32_t pass, const KnownBodies& known) {
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (const std::int32_t place = known.place[bodies[i]]; place >= 0)
      scratch_.passes.begin(static_cast<std::uint32_t>(place), manifolds,
                            scratch_.island_states[i]);
  if (pass == 0) return;
  for (const std::uint32_t body : bodies)
    if (remembers() && known.place[body] >= 0)
      memo_.islands[static_cast<std::size_t>(known.place[body])] = {};
  ++stages_.islands_again;
  physics::forget_reports(scratch_.island_ids, report_);
  std::erase_if(next_view_.known, [this](const Node& node) {
    return std::ranges::binary_search(scratch_.island_ids, node.id);
  });
}

void World::end_pass(std::span<const std::uint32_t> bodies, const KnownBodies& known) {
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (const std::int32_t place = known.place[bodies[i]]; place >= 0)
      scratch_.passes.end(*rules_.scene, around_.geometry, scratch_.island_ids[i],
                          static_cast<std::uint32_t>(place), scratch_.island_states[i],
                          &scratch_.boxes[static_cast<std::size_t>(place)]);
}

void World::note_owners(std::size_t island, const KnownBodies& known) {
  if (!around_.gating) return;
  std::vector<WorldId> owners;
  const physics::Islands& islands = scratch_.islands;
  for (std::uint32_t i = islands.body_begin[island]; i < islands.body_begin[island + 1]; ++i)
    owners.push_back(known.owners[islands.bodies[i]]);
  note_group(scratch_.island_ids, owners, id_, next_gate_.groups);
}

// The paper's constraint-solver rollback.
void World::start_warm() {
  if (around_.rollback != RollbackMode::kWarm) return;
  counters_.islands_warm += repetition_.take_impulses(scratch_.island_ids, scratch_.island_states);
}

void World::advance_own_island(std::uint32_t pass) {
  physics::IslandReport report;
  const bool taken =
      pass == 0 && repetition_.take_island(scratch_.island_ids, scratch_.island_states, &report);
  if (!taken && (pass > 0 || !take_resting(report))) {
    start_warm();
    report =
        physics::advance_island(physics::whole_step(*rules_.scene, around_.geometry,
                                                    scratch_.island_ids, scratch_.island_manifolds),
                                scratch_.island_states, {scratch_.solve, stages_, report_.faults});
    if (report.rests && pass == 0)
      scratch_.resting.keep(scratch_.island_ids, scratch_.island_manifolds, scratch_.island_states,
                            report);
  }
  report_.islands.push_back(report);
  count_repetition(taken, scratch_.island_ids.size());
}

bool World::take_resting(physics::IslandReport& report) {
  const physics::IslandReport* const known = scratch_.resting.take_island(scratch_.island_ids);
  if (known == nullptr) return false;
  report = *known;
  ++stages_.islands_at_rest;
  return true;
}

// Own ones, except those that a repetition takes over.
void World::advance_free_bodies() {
  std::vector<std::uint32_t> free;
  for (std::uint32_t body = 0; body < ids_.size(); ++body) {
    if (!scratch_.passes.is_free(body)) continue;
    const BodyId id = ids_[body];
    if (remembers()) memo_.islands[body] = {id, 1};
    const bool taken = repetition_.take_island({&id, 1}, {&states_[body], 1}, nullptr);
    count_repetition(taken, 1);
    if (!taken) free.push_back(body);
  }
  physics::advance_free_bodies(physics::whole_step(*rules_.scene, around_.geometry, ids_, {}), free,
                               states_, stages_, report_.faults);
}

void World::count_repetition(bool taken, std::size_t bodies) {
  if (!repetition_.repeats()) return;
  ++(taken ? counters_.islands_taken : counters_.islands_repeated);
  (taken ? counters_.bodies_taken : counters_.bodies_repeated) += bodies;
}

void World::remember_island(std::size_t island, const KnownBodies& known, bool mixed) {
  const physics::Islands& islands = scratch_.islands;
  const std::uint32_t first = islands.body_begin[island], last = islands.body_begin[island + 1];
  const StepMemo::Membership membership{known.ids[islands.bodies[first]], mixed ? 0 : last - first};
  for (std::uint32_t i = first; i < last; ++i) {
    const std::int32_t place = known.place[islands.bodies[i]];
    if (place >= 0) memo_.islands[static_cast<std::size_t>(place)] = membership;
  }
}

// Of the worlds in one process, the first to come solves; the others find its solution. The owner
// of the label reports the island, and its process is the one whose solve is not done elsewhere.
void World::advance_mixed_island(std::int64_t step, WorldId label_owner) {
  ++counters_.mixed_islands;
  start_warm();
  kernel::Bytes input;
  encode_island(scratch_.island_ids, scratch_.island_manifolds, scratch_.island_states, input);
  if (!rules_.inputs->changes.empty())
    encode_changeable(*rules_.scene, scratch_.island_ids, scratch_.island_manifolds, input);
  std::shared_ptr<const SolvedIsland> solved = around_.solves.find(input);
  const bool is_fresh = solved == nullptr;
  if (solved) {
    ++counters_.islands_reused;
  } else {
    auto fresh = std::make_shared<SolvedIsland>();
    physics::StageCounters work;
    fresh->report =
        physics::advance_island(physics::whole_step(*rules_.scene, around_.geometry,
                                                    scratch_.island_ids, scratch_.island_manifolds),
                                scratch_.island_states, {scratch_.solve, work, fresh->faults});
    stages_ += work;
    const auto process_of = [this](WorldId world) {
      return around_.processes.owner_of(kernel::LpId{index_of(world)});
    };
    if (process_of(label_owner) != process_of(id_)) replicated_ += work;
    fresh->states = scratch_.island_states;
    solved = fresh;
    around_.solves.store(step, std::move(input), std::move(fresh));
  }
  count_repetition(!is_fresh, scratch_.island_ids.size());
  scratch_.island_states = solved->states;
  if (label_owner == id_) report_.islands.push_back(solved->report);
  report_.faults.insert(report_.faults.end(), solved->faults.begin(), solved->faults.end());
}

// Speculation can produce absurd states: a fault is data until GVT passes this event. One fault an
// event is told, the lowest own body's.
void World::report_faults(kernel::Outbox& outbox) const {
  const physics::AdvanceFault* lowest = nullptr;
  for (const physics::AdvanceFault& fault : report_.faults) {
    if (!std::binary_search(ids_.begin(), ids_.end(), fault.body)) continue;
    if (lowest == nullptr || fault.body < lowest->body) lowest = &fault;
  }
  if (lowest != nullptr) outbox.fault({physics::index_of(lowest->body), lowest->what});
}

// Whether there are any.
bool World::send_migrants(std::int64_t step, kernel::Outbox& outbox) {
  std::map<WorldId, std::vector<Migrant>> leaving;
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    if (covers_.keeps(i, states_[i].position_m)) continue;
    const WorldId owner = rules_.map->owner_at(states_[i].position_m);
    if (owner == id_) continue;
    leaving[owner].push_back({ids_[i], states_[i]});
    if (!guesses()) continue;
    add_world(owner, next_view_.sent_to);
    next_view_.known.push_back({ids_[i], owner, states_[i]});
  }
  const bool somebody_leaves = !leaving.empty();
  if (around_.gating) {
    for (const auto& [owner, migrants] : leaving) next_gate_.left_to.push_back(owner);
    for (const WorldId expecting : next_gate_.migrants) leaving[expecting];
  }
  for (const auto& [owner, migrants] : leaving) {
    counters_.migrations += migrants.size();
    send(owner, time_of(step + 1, Phase::kBegin), MessageKind::kMigrants, encode_migrants(migrants),
         outbox);
  }
  return somebody_leaves;
}

}  // namespace soda::models
