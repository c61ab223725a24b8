#include "models/world/world.hpp"

#include <xxhash.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "kernel/api/hash_mix.hpp"
#include "models/world/absorption.hpp"
#include "models/world/border_contacts.hpp"
#include "physics/measures/measures.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::ContactManifold;

// Bodies that have left stay no longer.
void drop_foreign(const TerritoryMap& map, WorldId self, std::vector<BodyId>& ids,
                  std::vector<BodyState>& states) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (map.owner_at(states[i].position_m) != self) continue;
    if (kept != i) {
      ids[kept] = ids[i];
      states[kept] = std::move(states[i]);
    }
    ++kept;
  }
  ids.resize(kept);
  states.resize(kept);
}

// Migrants join the own bodies; returns those that did. While a migration is being rolled back an
// id can arrive twice or be here still: the body that is here wins, then the one from the lowest
// source, whatever the order of arrival.
std::vector<Migrant> merge_migrants(std::vector<Migrant> migrants, std::vector<BodyId>& ids,
                                    std::vector<BodyState>& states) {
  std::stable_sort(migrants.begin(), migrants.end(),
                   [](const Migrant& a, const Migrant& b) { return a.id < b.id; });
  const auto is_here = [&ids, &states](const Migrant& migrant) {
    const auto place = std::lower_bound(ids.begin(), ids.end(), migrant.id);
    if (place != ids.end() && *place == migrant.id) return true;
    states.insert(states.begin() + (place - ids.begin()), migrant.state);
    ids.insert(place, migrant.id);
    return false;
  };
  std::erase_if(migrants, is_here);
  return migrants;
}

}  // namespace

World::World(const WorldSurroundings& surroundings, WorldId id, std::int64_t buffer,
             BufferEntry initial)
    : around_(surroundings),
      id_(id),
      next_(time_of(initial.step, Phase::kBegin)),
      // `buffer` entries ahead and the one at GVT.
      buffer_(static_cast<std::size_t>(buffer) + 1, std::move(initial)),
      rules_(buffer_.rules(buffer_.newest())) {}

void World::execute(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) {
  const Phase phase = phase_of(now);
  const bool is_of_every_step =
      phase == Phase::kFinish ||
      (pass_of(now) == 0 && (phase == Phase::kBegin || phase == Phase::kPairs));
  counters_.events_alone += index_of(id_) == 0 && is_of_every_step;
  switch (phase) {
    case Phase::kBegin:
      begin(now.t, bag);
      return detect(now.t, outbox);
    case Phase::kBorderTraversal:
      return pass_of(now) == 0 ? border_traversal(now.t, bag) : hear_of_sent(now, bag, outbox);
    case Phase::kPairs:
      return pass_of(now) == 0 ? pairs(now.t, outbox) : connect_sent(now, bag, outbox);
    case Phase::kSync:
      return sync(now, bag, outbox);
    case Phase::kSplit:
      return split(now, bag, outbox);
    case Phase::kSolve:
      return solve(now, bag, outbox);
    case Phase::kFinish:
      return finish(now.t, outbox);
  }
}

// Own bodies: those of the entry that did not leave (under the map that the step before had), and
// those that migrate in. Then user input.
void World::begin(std::int64_t step, Bag bag) {
  const std::shared_ptr<const physics::SceneDescription> scene_before = rules_.scene;
  rules_ = buffer_.rules(step);
  ghosts_.clear();
  sent_.clear();
  gate_ = buffer_.gate(step);
  expected_ = expected_from(gate_, id_);
  next_gate_ = {};
  solves_ = 0;
  next_view_ = {};
  merge_ = {};
  splits_.clear();
  scratch_.manifolds.clear();
  report_.islands.clear();
  report_.faults.clear();
  if (keeps_history_) {
    buffer_.copy_bodies(step, ids_, states_, counters_);
    ++counters_.entries_saved;
  } else {
    buffer_.take_bodies(ids_, states_);
  }
  if (divided() && buffer_.may_leave(step)) drop_foreign(*rules_.map, id_, ids_, states_);
  std::vector<Migrant> migrants;
  std::vector<CellTransfer> transfers;
  if (around_.gating) next_gate_.migrants = gate_.left_to;
  owed_ = buffer_.view(step).told;
  for (const kernel::MessageView& message : bag) {
    if (message.kind == static_cast<std::uint32_t>(MessageKind::kTransfers))
      decode_transfers(message.payload, transfers);
    if (message.kind != static_cast<std::uint32_t>(MessageKind::kMigrants)) continue;
    const std::size_t before = migrants.size();
    decode_migrants(message.payload, migrants);
    if (migrants.size() == before) continue;
    const WorldId from{kernel::index_of(message.source)};
    if (around_.gating) next_gate_.migrants.push_back(from);
    if (guesses()) add_world(from, owed_);
  }
  sort_unique(next_gate_.migrants);
  // Bodies of these cells stay until the end of the step: they leave as any others.
  if (!transfers.empty()) rules_.map = around_.maps.after(rules_.map, transfers);
  migrants = merge_migrants(std::move(migrants), ids_, states_);
  const StoredEntry* const replaced = propagates() ? buffer_.stale_next() : nullptr;
  repetition_.start(buffer_.differs(step), replaced, *rules_.map);
  repetition_.note_own(ids_, migrants);
  std::vector<BodyId> touched = take_inputs(bag);
  if (rules_.scene != scene_before) scratch_.resting.forget();
  // Of what was computed with other materials, nothing can be taken.
  if (replaced != nullptr) repetition_.note_constants(rules_of(*replaced).scene == rules_.scene);
  repetition_.note_touched(touched);
  memo_.valid = remembers();
  memo_.connects = false;
  memo_.sent.clear();
  if (remembers()) {
    std::swap(memo_.migrants, migrants);
    std::swap(memo_.touched, touched);
  }
  counters_.steps_repeated += repetition_.repeats();
}

// Swept boxes; own bodies go as ghosts to every other world whose cells their box covers.
void World::detect(std::int64_t step, kernel::Outbox& outbox) {
  const bool quiet = expected_.ghosts_from.empty() && news_from(buffer_.view(step)).empty();
  next_ = time_of(step, quiet ? Phase::kPairs : Phase::kBorderTraversal);
  if (!divided()) return;
  physics::compute_boxes(*rules_.scene, around_.geometry, ids_, states_, scratch_.boxes, stages_);
  std::map<WorldId, std::vector<Ghost>> ghosts;
  for (const WorldId expecting : expected_.ghosts_to) ghosts[expecting];
  for (const WorldId expecting : owed_) ghosts[expecting];
  covers_.start(rules_.map, id_, ids_.size());
  std::vector<std::uint64_t> keys;
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    const CoveredCells covered = covers_.find(i, scratch_.boxes[i]);
    for (const std::uint32_t cell : covered.border_cells) keys.push_back(border_key(cell, i));
    for (const std::uint32_t owner : covered.others)
      ghosts[WorldId{owner}].push_back({ids_[i], id_, scratch_.boxes[i], states_[i]});
  }
  counters_.border_tests += ids_.size();
  if (remembers()) index_border(ids_, scratch_.boxes, keys, memo_.border);
  for (const auto& [owner, bodies] : ghosts) {
    counters_.ghosts_sent += bodies.size();
    if (guesses() && !bodies.empty()) next_view_.told.push_back(owner);
    send(owner, time_of(step, Phase::kBorderTraversal), MessageKind::kGhosts, encode_ghosts(bodies),
         outbox);
  }
}

void World::border_traversal(std::int64_t step, Bag bag) {
  std::vector<Ghost> ghosts;
  if (guesses())
    ghosts = ghosts_and_guesses(step, bag);
  else
    for (const kernel::MessageView& message : bag) decode_ghosts(message.payload, ghosts);
  ghosts_ = foreign_ghosts(std::move(ghosts), own_bodies(step));
  next_ = time_of(step, Phase::kPairs);
}

// Contacts; those with a foreign body go to its owner.
void World::pairs(std::int64_t step, kernel::Outbox& outbox) {
  next_ = time_of(step, Phase::kFinish);
  if (!divided())
    return physics::find_contacts_alone(*rules_.scene, around_.geometry, ids_, states_, scratch_,
                                        stages_);
  next_ = after_round(step, next_round(gate_, expected_, 0));
  if (ghosts_.empty() && expected_.fragments_to.empty() && !repetition_.can_take()) {
    physics::find_contacts(*rules_.scene, around_.geometry, ids_, states_, scratch_, stages_);
    if (remembers()) remember_contacts(step, {});
    if (audits()) audit_contacts(step, {});
    return;
  }
  repetition_.note_ghosts(ghosts_);
  scratch_.resting.start(ids_, states_);
  BorderContacts contacts =
      find_border_contacts(*rules_.scene, around_.geometry, *rules_.map, id_, ids_, states_,
                           scratch_.boxes, ghosts_, {repetition_, scratch_.resting}, stages_);
  scratch_.manifolds = std::move(contacts.manifolds);
  replicated_.candidate_pairs += contacts.pairs_of_others;
  if (remembers()) remember_contacts(step, contacts.for_others);
  merge_.nodes = std::move(contacts.foreign);
  if (audits()) audit_contacts(step, contacts.fragments);
  send_fragments(step, std::move(contacts.fragments), outbox);
  if (!merge_.nodes.empty()) next_ = time_of(step, Phase::kSync);
}

// Before the merge rounds add contacts that others have tested.
void World::remember_contacts(std::int64_t step, std::span<const ContactManifold> for_others) {
  memo_.ghosts = ghosts_;
  std::vector<ContactManifold> merged;
  std::span<const ContactManifold> tested = scratch_.manifolds;
  if (!for_others.empty()) {
    merged.assign(tested.begin(), tested.end());
    merged.insert(merged.end(), for_others.begin(), for_others.end());
    std::sort(merged.begin(), merged.end(), canonical_before);
    tested = merged;
  }
  const std::uint64_t before = buffer_.memory().taken_bytes;
  memo_.tested = {buffer_.memory(), tested, buffer_.stored(step)->tested};
  counters_.memo_bytes_stored += buffer_.memory().taken_bytes - before;
}

void World::send(WorldId to, kernel::VirtualTime when, MessageKind kind, kernel::Payload payload,
                 kernel::Outbox& outbox) {
  counters_.bytes_sent += payload.size();
  outbox.send(kernel::LpId{index_of(to)}, when, static_cast<std::uint32_t>(kind),
              std::move(payload));
}

void World::mark(kernel::VirtualTime) { keeps_history_ = true; }

// Entries after the restart point are void: their steps are executed again.
kernel::VirtualTime World::rewind(kernel::VirtualTime to) {
  buffer_.truncate(to.t, counters_);
  tell_newest();
  next_ = time_of(to.t, Phase::kBegin);
  return next_;
}

bool World::is_as_before() const {
  if (phase_of(next_) != Phase::kBegin) return false;
  return buffer_.newest_is_as_before() && buffer_.has_stale();
}

void World::jump(kernel::VirtualTime limit) {
  buffer_.put_back(limit.t, counters_);
  counters_.steps_put_back += static_cast<std::uint64_t>(buffer_.newest() - next_.t);
  next_ = time_of(buffer_.newest(), Phase::kBegin);
  tell_newest();
}

kernel::VirtualTime World::forget(kernel::VirtualTime horizon) {
  buffer_.forget(horizon.t);
  return time_of(buffer_.oldest(), Phase::kBegin);
}

void World::commit(kernel::VirtualTime now) {
  if (phase_of(now) != Phase::kFinish) return;
  const bool samples = around_.sampling.takes(now.t + 1);
  const BufferEntry& entry =
      buffer_.read(now.t + 1, samples || around_.commits.wants_states(now.t + 1), committed_);
  counters_.solves_committed += entry.solves;
  around_.commits.add(id_, entry);
  audit_.commit(now.t, counters_);
  if (!samples) return;
  LoadSample sample = sample_load(id_, entry, around_.geometry, around_.sampling);
  sample.spent_ns = entry.spent_ns;
  sample.entries = buffer_.newest() - entry.step;
  counters_.bodies_sampled += entry.ids.size();
  around_.loads->add(std::move(sample));
}

// Between steps, all that matters is the newest entry; within one, what its phases have gathered.
std::uint64_t World::digest() const {
  std::uint64_t digest = kernel::append(static_cast<std::uint64_t>(next_.t), next_.round);
  const bool is_between = phase_of(next_) == Phase::kBegin;
  // A rewind or a jump leaves rules_ as it was: it is set when a step begins.
  const Rules& rules = is_between ? buffer_.rules(buffer_.newest()) : rules_;
  for (const BodyId absent : rules.inputs->presence.absent())
    digest = kernel::append(digest, physics::index_of(absent));
  if (is_between) {
    BufferEntry copy;
    const BufferEntry& entry = newest_entry(copy);
    const auto owners = std::as_bytes(entry.rules.map->owners());
    digest = kernel::append(digest, XXH3_64bits(owners.data(), owners.size()));
    return kernel::append(digest, physics::digest(entry.ids, entry.states));
  }
  kernel::Bytes gathered;
  encode_island(ids_, scratch_.manifolds, states_, gathered);
  // From the contacts on, a ghost matters no more.
  const bool reads_ghosts = next_ <= time_of(next_.t, Phase::kPairs);
  const kernel::Payload ghosts = encode_ghosts(reads_ghosts ? ghosts_ : std::vector<Ghost>{});
  const kernel::Payload nodes = encode_records({merge_.nodes, {}});
  for (const std::span<const std::byte> bytes :
       {std::span<const std::byte>(gathered), ghosts.bytes(), nodes.bytes()})
    digest = kernel::append(digest, XXH3_64bits(bytes.data(), bytes.size()));
  if (divided() && pass_of(next_) > 0) {
    kernel::Bytes begun;
    encode_island(ids_, {}, states_at_start(), begun);
    const kernel::Payload sent = encode_sent(sent_);
    for (const std::span<const std::byte> bytes : {std::span<const std::byte>(begun), sent.bytes()})
      digest = kernel::append(digest, XXH3_64bits(bytes.data(), bytes.size()));
  }
  for (const std::unique_ptr<SplitSolve>& split : splits_)
    digest = kernel::append(digest, split->digest());
  for (const auto& [partner, records] : merge_.exchanged)
    for (const RecordKey& key : records)
      digest = kernel::append(
          kernel::append(kernel::append(digest, index_of(partner)), physics::index_of(key.first)),
          physics::index_of(key.second));
  return digest;
}

}  // namespace soda::models
