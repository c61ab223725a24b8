// Further passes of a step: bodies that hits have sent on, told to the worlds where they come to
// something new.
//
// A world that owns a body decides whether what is sent on meets it: it alone knows how the step
// ends for its body. It hears of what comes into its cells from the owner, and of what comes to its
// body elsewhere from the world that would test that pair in the first pass (border_contacts.hpp).
#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "models/world/world.hpp"

namespace soda::models {

using physics::BodyState;

namespace {

// What is told again replaces what was known.
void take_in(kernel::MessageView message, std::vector<SentBody>& sent) {
  std::vector<SentBody> bodies;
  decode_sent(message.payload, bodies);
  for (SentBody& body : bodies) {
    const auto id_of = [](const SentBody& known) { return known.ghost.id; };
    const auto at = std::ranges::lower_bound(sent, body.ghost.id, {}, id_of);
    if (at != sent.end() && at->ghost.id == body.ghost.id)
      *at = std::move(body);
    else
      sent.insert(at, std::move(body));
  }
}

}  // namespace

SentBody World::sent_own(std::uint32_t place) const {
  return {
      {ids_[place], id_, scratch_.boxes[place], scratch_.passes.start_of(place, states_[place])},
      states_[place]};
}

std::vector<BodyState> World::states_at_start() const {
  std::vector<BodyState> states;
  states.reserve(ids_.size());
  for (std::uint32_t i = 0; i < ids_.size(); ++i)
    states.push_back(scratch_.passes.start_of(i, states_[i]));
  return states;
}

// Those of this pass go where their boxes lead, in time for the next one.
void World::send_sent(kernel::VirtualTime now, kernel::Outbox& outbox) {
  const std::uint32_t pass = pass_of(now) + 1;
  std::map<WorldId, std::vector<SentBody>> told;
  std::vector<WorldId> owners;
  for (const auto& [place, box] : scratch_.passes.sent()) {
    scratch_.boxes[place] = box;
    if (remembers()) memo_.sent.push_back({id_, box});
    const SentBody sent = sent_own(place);
    rules_.map->owners_of(box, owners);
    for (const WorldId owner : owners)
      if (owner != id_) told[owner].push_back(sent);
    pass_on(sent, time_of(now.t, Phase::kPairs, 0, pass), outbox);
  }
  scratch_.passes.next_pass();
  for (const auto& [owner, bodies] : told) {
    counters_.ghosts_sent += bodies.size();
    send(owner, time_of(now.t, Phase::kBorderTraversal, 0, pass), MessageKind::kSent,
         encode_sent(bodies), outbox);
  }
}

// To the owners of foreign bodies that it may come to in a cell of this world.
void World::pass_on(const SentBody& sent, kernel::VirtualTime when, kernel::Outbox& outbox) {
  std::vector<WorldId> owners;
  const auto consider = [&](const Ghost& other) {
    if (other.owner == sent.ghost.owner || other.owner == id_) return;
    if (!physics::overlap(sent.ghost.box, other.box)) return;
    if (rules_.map->owner_at(sent.ghost.box.min.cwiseMax(other.box.min)) == id_)
      owners.push_back(other.owner);
  };
  for (const Ghost& ghost : ghosts_) consider(ghost);
  for (const SentBody& other : sent_) consider(other.ghost);
  sort_unique(owners);
  memo_.connects = memo_.connects || !owners.empty();
  for (const WorldId owner : owners) {
    ++counters_.ghosts_sent;
    send(owner, when, MessageKind::kSent, encode_sent({&sent, 1}), outbox);
  }
}

void World::hear_of_sent(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) {
  std::vector<SentBody> news;
  for (const kernel::MessageView& message : bag) take_in(message, news);
  for (const kernel::MessageView& message : bag) take_in(message, sent_);
  const kernel::VirtualTime when = time_of(now.t, Phase::kPairs, 0, pass_of(now));
  for (const SentBody& sent : news) {
    if (remembers()) memo_.sent.push_back({sent.ghost.owner, sent.ghost.box});
    pass_on(sent, when, outbox);
  }
  next_ = when;
}

// All bodies that are sent on, and own bodies that they may come to.
void World::connect_sent(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) {
  for (const kernel::MessageView& message : bag) take_in(message, sent_);
  std::erase_if(sent_, [this](const SentBody& sent) {
    return std::ranges::binary_search(ids_, sent.ghost.id);
  });
  std::vector<SentBody> all = sent_;
  for (const auto& [place, box] : scratch_.passes.ever_sent()) all.push_back(sent_own(place));
  std::map<WorldId, Fragment> fragments;
  bool any = false;
  for (const SentBody& sent : all)
    for (std::uint32_t own = 0; own < ids_.size(); ++own)
      any = connect(sent, own, fragments) || any;
  memo_.connects = memo_.connects || any;
  for (auto& [target, fragment] : fragments) {
    note_exchanged(fragment.records, target, merge_);
    counters_.fragments_sent += fragment.records.manifolds.size();
    send(target, time_of(now.t, Phase::kSync, 0, pass_of(now)), MessageKind::kFragments,
         encode_fragment(fragment), outbox);
  }
  const Phase next = merge_.nodes.empty() ? Phase::kSolve : Phase::kSync;
  next_ = any ? time_of(now.t, next, 0, pass_of(now)) : time_of(now.t, Phase::kFinish);
}

// Whether the two are connected from now on; if the one that is sent on is foreign, its owner hears
// of it.
bool World::connect(const SentBody& sent, std::uint32_t own,
                    std::map<WorldId, Fragment>& fragments) {
  const physics::BodyId id = ids_[own];
  const Ghost& ghost = sent.ghost;
  if (ghost.id == id || !physics::overlap(ghost.box, scratch_.boxes[own])) return false;
  const BodyState& start = scratch_.passes.start_of(own, states_[own]);
  const BodyState end = scratch_.passes.end_of(*rules_.scene, id, own, states_[own]);
  const physics::OnItsWay other{ghost.id, ghost.state, sent.end, ghost.box},
      mine{id, start, end, scratch_.boxes[own]};
  const auto& [a, b] = id < ghost.id ? std::tie(mine, other) : std::tie(other, mine);
  if (!physics::may_meet(*rules_.scene, around_.geometry, a, b, stages_)) return false;
  if (!physics::connect(*rules_.scene, a.id, a.start, b.id, scratch_.manifolds)) return false;
  if (ghost.owner == id_) return true;
  add_node(ids_, {ghost.id, ghost.owner, ghost.state}, merge_);
  Records& records = fragments[ghost.owner].records;
  const auto by_id = [](const Node& node) { return node.id; };
  const auto at = std::ranges::lower_bound(records.nodes, id, {}, by_id);
  if (at == records.nodes.end() || at->id != id) records.nodes.insert(at, {id, id_, start});
  physics::connect(*rules_.scene, a.id, a.start, b.id, records.manifolds);
  return true;
}

}  // namespace soda::models
