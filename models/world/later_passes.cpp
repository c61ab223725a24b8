#include "models/world/later_passes.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "models/islands/dependencies.hpp"

namespace soda::models {
namespace {

using physics::BodyState;

// What is sent again replaces what was known.
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

SentBody LaterPasses::own(std::uint32_t place) const {
  const BodyState& end = step_.states[place];
  return {{step_.ids[place], step_.self, step_.scratch.boxes[place],
           step_.scratch.passes.start_of(place, end)},
          end,
          step_.scratch.passes.linked_label_of(place)};
}

void LaterPasses::send(kernel::VirtualTime now, Outgoing& out) {
  const std::uint32_t pass = pass_of(now) + 1;
  physics::StepScratch& scratch = step_.scratch;
  std::map<WorldId, std::vector<SentBody>> outgoing;
  std::vector<WorldId> owners;
  for (const auto& [place, box] : scratch.passes.sent()) {
    scratch.boxes[place] = box;
    if (step_.remembers) step_.memo.sent.push_back({step_.self, box});
    const SentBody sent = own(place);
    step_.rules.map->owners_of(box, owners);
    for (const WorldId owner : owners)
      if (owner != step_.self) outgoing[owner].push_back(sent);
    pass_on(sent, time_of(now.t, Phase::kPairs, 0, pass), out);
  }
  scratch.passes.next_pass();
  for (const auto& [owner, bodies] : outgoing) {
    step_.work.worlds.ghosts_sent += bodies.size();
    out.send(owner, time_of(now.t, Phase::kBorderTraversal, 0, pass), MessageKind::kSent,
             encode_sent(bodies));
  }
}

// To the owners of foreign bodies that it may come to in a cell of this world.
void LaterPasses::pass_on(const SentBody& sent, kernel::VirtualTime when, Outgoing& out) {
  std::vector<WorldId> owners;
  const auto consider = [&](const Ghost& other) {
    if (other.owner == sent.ghost.owner || other.owner == step_.self) return;
    if (!physics::overlap(sent.ghost.box, other.box)) return;
    if (step_.rules.map->owner_at(sent.ghost.box.min.cwiseMax(other.box.min)) == step_.self)
      owners.push_back(other.owner);
  };
  for (const Ghost& ghost : step_.ghosts) consider(ghost);
  for (const SentBody& other : sent_) consider(other.ghost);
  sort_unique(owners);
  step_.memo.connects = step_.memo.connects || !owners.empty();
  for (const WorldId owner : owners) {
    ++step_.work.worlds.ghosts_sent;
    out.send(owner, when, MessageKind::kSent, encode_sent({&sent, 1}));
  }
}

void LaterPasses::receive(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  std::vector<SentBody> news;
  for (const kernel::MessageView& message : bag) take_in(message, news);
  for (const kernel::MessageView& message : bag) take_in(message, sent_);
  const kernel::VirtualTime when = time_of(now.t, Phase::kPairs, 0, pass_of(now));
  for (const SentBody& sent : news) {
    if (step_.remembers) step_.memo.sent.push_back({sent.ghost.owner, sent.ghost.box});
    pass_on(sent, when, out);
  }
}

bool LaterPasses::connect(kernel::VirtualTime now, Bag bag, Outgoing& out) {
  for (const kernel::MessageView& message : bag) take_in(message, sent_);
  std::erase_if(sent_, [this](const SentBody& sent) {
    return std::ranges::binary_search(step_.ids, sent.ghost.id);
  });
  std::vector<SentBody> all = sent_;
  for (const auto& [place, box] : step_.scratch.passes.ever_sent()) all.push_back(own(place));
  std::map<WorldId, Fragment> fragments;
  bool any = false;
  for (const SentBody& sent : all)
    for (std::uint32_t place = 0; place < step_.ids.size(); ++place)
      any = connect(sent, place, fragments) || any;
  step_.memo.connects = step_.memo.connects || any;
  for (auto& [target, fragment] : fragments) {
    note_exchanged(fragment.records, target, step_.merge);
    step_.work.worlds.fragments_sent += fragment.records.manifolds.size();
    out.send(target, time_of(now.t, Phase::kSync, 0, pass_of(now)), MessageKind::kFragments,
             encode_fragment(fragment));
  }
  return any;
}

// Whether the two are connected from now on; if the one that is sent on is foreign, its owner
// receives the contact.
bool LaterPasses::connect(const SentBody& sent, std::uint32_t own,
                          std::map<WorldId, Fragment>& fragments) {
  const physics::SceneDescription& scene = *step_.rules.scene;
  physics::StepScratch& scratch = step_.scratch;
  const physics::BodyId id = step_.ids[own];
  const Ghost& ghost = sent.ghost;
  if (ghost.id == id || !physics::overlap(ghost.box, scratch.boxes[own])) return false;
  const BodyState& start = scratch.passes.start_of(own, step_.states[own]);
  const BodyState end = scratch.passes.end_of(scene, id, own, step_.states[own]);
  const physics::MovingBody other{ghost.id, ghost.state, sent.end, ghost.box, sent.linked},
      mine{id, start, end, scratch.boxes[own], scratch.passes.linked_label_of(own)};
  const auto& [a, b] = id < ghost.id ? std::tie(mine, other) : std::tie(other, mine);
  if (!physics::may_meet(scene, step_.around.geometry, a, b, step_.work.stages)) return false;
  if (!physics::connect(scene, a.id, a.start, b.id, scratch.manifolds)) return false;
  if (ghost.owner == step_.self) return true;
  add_node(step_.ids, {ghost.id, ghost.owner, ghost.state}, step_.merge);
  Records& records = fragments[ghost.owner].records;
  const auto by_id = [](const Node& node) { return node.id; };
  const auto at = std::ranges::lower_bound(records.nodes, id, {}, by_id);
  if (at == records.nodes.end() || at->id != id) records.nodes.insert(at, {id, step_.self, start});
  physics::connect(scene, a.id, a.start, b.id, records.manifolds);
  return true;
}

}  // namespace soda::models
