#include "models/world/world.hpp"

#include <xxhash.h>

#include <algorithm>
#include <utility>

#include "kernel/api/hash_mix.hpp"
#include "models/world/arrivals.hpp"
#include "models/world/border_contacts.hpp"
#include "physics/measures/measures.hpp"

namespace soda::models {
namespace {

using physics::BodyId;

// Speculation can produce absurd states: a fault is data until GVT passes this event. One fault an
// event is told, the lowest own body's.
void report_faults(const StepInProgress& step, Outgoing& out) {
  const physics::AdvanceFault* lowest = nullptr;
  for (const physics::AdvanceFault& fault : step.report.faults) {
    if (!std::binary_search(step.ids.begin(), step.ids.end(), fault.body)) continue;
    if (lowest == nullptr || fault.body < lowest->body) lowest = &fault;
  }
  if (lowest != nullptr) out.fault({physics::index_of(lowest->body), lowest->what});
}

bool is_of_every_step(kernel::VirtualTime now) {
  const Phase phase = phase_of(now);
  return phase == Phase::kFinish ||
         (pass_of(now) == 0 && (phase == Phase::kBegin || phase == Phase::kPairs));
}

std::uint64_t append_bytes(std::uint64_t digest, std::span<const std::byte> bytes) {
  return kernel::append(digest, XXH3_64bits(bytes.data(), bytes.size()));
}

}  // namespace

World::World(const WorldSurroundings& surroundings, WorldId id, std::int64_t buffer,
             BufferEntry initial)
    : next_(time_of(initial.step, Phase::kBegin)),
      // `buffer` entries ahead and the one at GVT.
      buffer_(static_cast<std::size_t>(buffer) + 1, std::move(initial)),
      step_{.around = surroundings, .self = id, .rules = buffer_.rules(buffer_.newest())},
      waits_(surroundings.gating, id) {}

void World::execute(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) {
  step_.work.worlds.events_alone += index_of(step_.self) == 0 && is_of_every_step(now);
  Outgoing out(outbox, step_.work.worlds);
  switch (phase_of(now)) {
    case Phase::kBegin:
      begin(now.t, bag);
      return detect(now.t, out);
    case Phase::kBorderTraversal:
      return border_traversal(now, bag, out);
    case Phase::kPairs:
      return pairs(now, bag, out);
    case Phase::kSync:
      return sync(now, bag, out);
    case Phase::kSplit:
      return split(now, bag, out);
    case Phase::kSolve:
      return solve(now, bag, out);
    case Phase::kFinish:
      return finish(now.t, out);
  }
}

// Own bodies: those of the entry that did not leave (under the map that the step before had), and
// those that migrate in. Then user input.
void World::begin(std::int64_t step, Bag bag) {
  const std::shared_ptr<const physics::SceneDescription> scene_before = step_.rules.scene;
  start_parts(step);
  take_bodies(step);
  Arrivals arrivals = read_arrivals(bag);
  waits_.note_migrants_from(arrivals.sources);
  extrapolation_.note_migrants_from(arrivals.sources);
  // Bodies of these cells stay until the end of the step: they leave as any others.
  if (!arrivals.transfers.empty())
    step_.rules.map = step_.around.maps.after(step_.rules.map, arrivals.transfers);
  recorder_.start(step, merge_migrants(std::move(arrivals.migrants), step_.ids, step_.states));
  std::vector<BodyId> touched = take_inputs(step_, bag);
  if (step_.rules.scene != scene_before) step_.scratch.resting.forget();
  recorder_.note_inputs(std::move(touched));
}

void World::start_parts(std::int64_t step) {
  step_.start(buffer_.rules(step));
  step_.remembers = keeps_history_ && step_.divided() && step_.propagates();
  waits_.start(buffer_.dependencies(step));
  extrapolation_.start(buffer_.view(step), step_.around.audits && keeps_history_);
  splits_.start();
  passes_.start();
}

void World::take_bodies(std::int64_t step) {
  if (keeps_history_) {
    buffer_.copy_bodies(step, step_.ids, step_.states, step_.work.worlds);
    ++step_.work.worlds.entries_saved;
  } else {
    buffer_.take_bodies(step_.ids, step_.states);
  }
  if (step_.divided() && buffer_.may_leave(step))
    drop_foreign(*step_.rules.map, step_.self, step_.ids, step_.states);
}

// Swept boxes, and who else has to know of them.
void World::detect(std::int64_t step, Outgoing& out) {
  const bool quiet = waits_.expected().ghosts_from.empty() && news_from(buffer_.view(step)).empty();
  next_ = time_of(step, quiet ? Phase::kPairs : Phase::kBorderTraversal);
  if (!step_.divided()) return;
  physics::compute_boxes(*step_.rules.scene, step_.around.geometry, step_.ids, step_.states,
                         step_.scratch.boxes, step_.work.stages);
  borders_.send_ghosts(step, out);
}

void World::border_traversal(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  next_ = time_of(now.t, Phase::kPairs, 0, pass_of(now));
  return pass_of(now) == 0 ? receive_ghosts(now.t, bag) : passes_.receive(now, bag, out);
}

void World::receive_ghosts(std::int64_t step, Bag bag) {
  std::vector<Ghost> ghosts;
  if (extrapolation_.is_on())
    ghosts = extrapolation_.complete(step, bag, buffer_.view(step));
  else
    for (const kernel::MessageView& message : bag) decode_ghosts(message.payload, ghosts);
  step_.ghosts = foreign_ghosts(std::move(ghosts), [this](BodyId id) {
    return std::binary_search(step_.ids.begin(), step_.ids.end(), id);
  });
}

void World::pairs(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  if (pass_of(now) == 0) return find_contacts(now.t, out);
  const bool any = passes_.connect(now, bag, out);
  const Phase next = step_.merge.nodes.empty() ? Phase::kSolve : Phase::kSync;
  next_ = any ? time_of(now.t, next, 0, pass_of(now)) : time_of(now.t, Phase::kFinish);
}

// Contacts; those with a foreign body go to its owner.
void World::find_contacts(std::int64_t step, Outgoing& out) {
  const physics::SceneDescription& scene = *step_.rules.scene;
  const physics::Geometry& geometry = step_.around.geometry;
  physics::StepScratch& scratch = step_.scratch;
  next_ = time_of(step, Phase::kFinish);
  if (!step_.divided())
    return physics::find_contacts_alone(scene, geometry, step_.ids, step_.states, scratch,
                                        step_.work.stages);
  next_ = after_round(step, waits_.next_round(0));
  if (step_.ghosts.empty() && waits_.expected().fragments_to.empty() &&
      !step_.repetition.can_take()) {
    physics::find_contacts(scene, geometry, step_.ids, step_.states, scratch, step_.work.stages);
    recorder_.remember_contacts(step, {});
    return extrapolation_.audit_contacts(step, {});
  }
  step_.repetition.note_ghosts(step_.ghosts);
  scratch.resting.start(step_.ids, step_.states);
  BorderContacts contacts =
      find_border_contacts(scene, geometry, *step_.rules.map,
                           {step_.self, step_.ids, step_.states, scratch.boxes, step_.ghosts},
                           {step_.repetition, scratch.resting}, step_.work.stages);
  scratch.manifolds = std::move(contacts.manifolds);
  step_.work.replicated.candidate_pairs += contacts.pairs_of_others;
  recorder_.remember_contacts(step, contacts.for_others);
  step_.merge.nodes = std::move(contacts.foreign);
  extrapolation_.audit_contacts(step, contacts.fragments);
  exchange_.send_fragments(step, std::move(contacts.fragments), out);
  if (!step_.merge.nodes.empty()) next_ = time_of(step, Phase::kSync);
}

void World::sync(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  exchange_.merge_round(now, bag, out);
  next_ = pass_of(now) > 0 ? time_of(now.t, Phase::kSolve, 0, pass_of(now))
                           : after_round(now.t, waits_.next_round(merge_round_of(now) + 1));
}

kernel::VirtualTime World::after_round(std::int64_t step, std::uint32_t next) const {
  if (next != kNoRound) return time_of(step, Phase::kSync, next);
  return time_of(step, splits_.may_split() ? Phase::kSplit : Phase::kSolve);
}

// Letters of a world that knows an island otherwise can come at any time, and mean nothing here.
void World::split(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  if (now != next_) return;
  const bool goes_on = splits_.round(now, bag, out);
  next_ = goes_on ? time_of(now.t, Phase::kSplit, merge_round_of(now) + 1)
                  : time_of(now.t, Phase::kSolve);
}

// Does not wait for foreign news: what comes later is a straggler.
void World::solve(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  if (pass_of(now) == 0) step_.scratch.passes.start(step_.ids.size());
  const bool advanced = islands_.advance_known_islands(now, bag);
  // Warm solves depend on the rollbacks before, and what others are sent within a step must not.
  const bool sends = step_.around.rollback != RollbackMode::kWarm && passes_.any_sent();
  if (sends) passes_.send(now, out);
  next_ = advanced && sends ? time_of(now.t, Phase::kPairs, 0, pass_of(now) + 1)
                            : time_of(now.t, Phase::kFinish);
}

// Bodies without contact move, the entry of the next step is written.
void World::finish(std::int64_t step, Outgoing& out) {
  if (step_.divided()) {
    step_.scratch.resting.finish();
    std::ranges::sort(step_.report.islands, {}, &physics::IslandReport::label);
    islands_.advance_free_bodies();
  } else {
    physics::advance_bodies(*step_.rules.scene, step_.around.geometry, step_.ids, step_.states,
                            {step_.scratch, step_.report, step_.work.stages});
    step_.solves = static_cast<std::uint32_t>(step_.report.islands.size());
  }
  report_faults(step_, out);
  const bool somebody_leaves = step_.divided() && borders_.send_migrants(step, out);
  if (!keeps_history_) buffer_.forget(step);
  recorder_.write_entry(step, somebody_leaves, keeps_history_, out);
  tell_newest();
  next_ = time_of(step + 1, Phase::kBegin);
}

void World::tell_newest() const {
  EntryObserver* const observer = step_.around.entries;
  if (observer != nullptr) observer->on_newest(step_.self, buffer_.newest());
}

void World::mark(kernel::VirtualTime) { keeps_history_ = true; }

// Entries after the restart point are void: their steps are executed again.
kernel::VirtualTime World::rewind(kernel::VirtualTime to) {
  buffer_.truncate(to.t, step_.work.worlds);
  tell_newest();
  next_ = time_of(to.t, Phase::kBegin);
  return next_;
}

bool World::absorb(kernel::VirtualTime now, Bag bag) { return stragglers_.absorb(now, bag, next_); }

bool World::is_as_before() const {
  if (phase_of(next_) != Phase::kBegin) return false;
  return buffer_.newest_is_as_before() && buffer_.has_stale();
}

void World::jump(kernel::VirtualTime limit) {
  buffer_.put_back(limit.t, step_.work.worlds);
  step_.work.worlds.steps_put_back += static_cast<std::uint64_t>(buffer_.newest() - next_.t);
  next_ = time_of(buffer_.newest(), Phase::kBegin);
  tell_newest();
}

kernel::VirtualTime World::forget(kernel::VirtualTime horizon) {
  buffer_.forget(horizon.t);
  return time_of(buffer_.oldest(), Phase::kBegin);
}

bool World::holds(kernel::VirtualTime now, Bag bag) const {
  if (now != next_ || pass_of(now) > 0) return false;
  switch (phase_of(now)) {
    case Phase::kSolve:
      return splits_.lack_outcome(bag);
    case Phase::kSplit:
      return merge_round_of(now) > 0 && splits_.lack_news(bag);
    case Phase::kBegin: {
      // The step has not begun: the waits are those of the one before.
      const Dependencies& dependencies = buffer_.dependencies(buffer_.newest());
      return lacks(dependencies, expected_from(dependencies, step_.self), now, bag);
    }
    default:
      return waits_.lacks(now, bag);
  }
}

// Whoever this world has mattered to. A ghost that matters to nobody would have been absorbed.
std::vector<kernel::LpId> World::eager_cancellations() const {
  const Expected expected = expected_from(buffer_.dependencies(buffer_.newest()), step_.self);
  std::vector<WorldId> worlds = expected.ghosts_to;
  worlds.insert(worlds.end(), expected.fragments_to.begin(), expected.fragments_to.end());
  sort_unique(worlds);
  std::vector<kernel::LpId> lps;
  lps.reserve(worlds.size());
  for (const WorldId world : worlds) lps.push_back(kernel::LpId{index_of(world)});
  return lps;
}

void World::commit(kernel::VirtualTime now) {
  if (phase_of(now) != Phase::kFinish) return;
  const WorldSurroundings& around = step_.around;
  const bool samples = around.sampling.takes(now.t + 1);
  const BufferEntry& entry =
      buffer_.read(now.t + 1, samples || around.commits.wants_states(now.t + 1), committed_);
  step_.work.worlds.solves_committed += entry.solves;
  around.commits.add(step_.self, entry);
  extrapolation_.commit(now.t);
  if (!samples) return;
  LoadSample sample = sample_load(step_.self, entry, around.geometry, around.sampling);
  sample.spent_ns = entry.spent_ns;
  sample.entries = buffer_.newest() - entry.step;
  step_.work.worlds.bodies_sampled += entry.ids.size();
  around.loads->add(std::move(sample));
}

// Between steps, all that matters is the newest entry; within one, what its phases have gathered.
std::uint64_t World::digest() const {
  std::uint64_t digest = kernel::append(static_cast<std::uint64_t>(next_.t), next_.round);
  const bool is_between = phase_of(next_) == Phase::kBegin;
  // A rewind or a jump leaves the rules of the step as they were: they are set when one begins.
  const Rules& rules = is_between ? buffer_.rules(buffer_.newest()) : step_.rules;
  for (const BodyId absent : rules.inputs->presence.absent())
    digest = kernel::append(digest, physics::index_of(absent));
  if (!is_between) return append_gathered(digest);
  BufferEntry copy;
  const BufferEntry& entry = newest_entry(copy);
  digest = append_bytes(digest, std::as_bytes(entry.rules.map->owners()));
  return kernel::append(digest, physics::digest(entry.ids, entry.states));
}

std::uint64_t World::append_gathered(std::uint64_t digest) const {
  kernel::Bytes gathered;
  encode_island(step_.ids, step_.scratch.manifolds, step_.states, gathered);
  digest = append_bytes(digest, gathered);
  // From the contacts on, a ghost matters no more.
  const bool reads_ghosts = next_ <= time_of(next_.t, Phase::kPairs);
  const kernel::Payload ghosts = encode_ghosts(reads_ghosts ? step_.ghosts : std::vector<Ghost>{});
  digest = append_bytes(digest, ghosts.bytes());
  const kernel::Payload nodes = encode_records({step_.merge.nodes, {}});
  digest = append_bytes(digest, nodes.bytes());
  if (step_.divided() && pass_of(next_) > 0) {
    kernel::Bytes begun;
    encode_island(step_.ids, {}, step_.states_at_start(), begun);
    digest = append_bytes(digest, begun);
    const kernel::Payload sent = encode_sent(passes_.foreign_sent());
    digest = append_bytes(digest, sent.bytes());
  }
  digest = splits_.digest(digest);
  for (const auto& [partner, records] : step_.merge.exchanged)
    for (const RecordKey& key : records)
      digest = kernel::append(
          kernel::append(kernel::append(digest, index_of(partner)), physics::index_of(key.first)),
          physics::index_of(key.second));
  return digest;
}

}  // namespace soda::models
