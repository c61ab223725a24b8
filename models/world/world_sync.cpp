// What worlds tell each other of cross-owner contacts: fragments, and records in merge rounds.
#include <algorithm>
#include <map>
#include <utility>

#include "models/world/world.hpp"

namespace soda::models {

// Those that another world waits for are sent even if they are empty.
void World::send_fragments(std::int64_t step, std::map<WorldId, Fragment> fragments,
                           kernel::Outbox& outbox) {
  for (const WorldId expecting : expected_.fragments_to) fragments[expecting];
  if (!gate_.groups.empty())
    add_group_fragments(gate_.groups, id_, known_bodies(ids_, id_, merge_), states_,
                        scratch_.manifolds, merge_, fragments);
  for (const auto& [target, fragment] : fragments) {
    note_exchanged(fragment.records, target, merge_);
    if (around_.gating && !fragment.records.manifolds.empty())
      next_gate_.tested_for.push_back(target);
    if (around_.gating && repetition_.can_take() && has_changed(fragment))
      outbox.withdraw(kernel::LpId{index_of(target)});
    counters_.fragments_sent += fragment.records.manifolds.size();
    for (const Fragment::OfGroup& group : fragment.groups) {
      note_exchanged(group.records, target, merge_);
      counters_.records_sent += group.records.nodes.size() + group.records.manifolds.size();
    }
    send(target, time_of(step, Phase::kSync), MessageKind::kFragments, encode_fragment(fragment),
         outbox);
  }
}

// Whether a repetition has found that a body which this world tests for others moves otherwise.
bool World::has_changed(const Fragment& fragment) const {
  const auto& nodes = fragment.records.nodes;
  return std::any_of(nodes.begin(), nodes.end(),
                     [this](const Node& node) { return !repetition_.unchanged(node.id); });
}

bool World::holds(kernel::VirtualTime now, Bag bag) const {
  if (now != next_) return false;
  const auto lacks_outcome = [bag](const auto& split) { return split->lacks_outcome(bag); };
  const auto lacks_news = [bag](const auto& split) { return split->lacks_news(bag); };
  if (pass_of(now) > 0) return false;
  if (phase_of(now) == Phase::kSolve)
    return std::any_of(splits_.begin(), splits_.end(), lacks_outcome);
  if (phase_of(now) == Phase::kSplit)
    return merge_round_of(now) > 0 && std::any_of(splits_.begin(), splits_.end(), lacks_news);
  if (phase_of(now) != Phase::kBegin) return lacks(gate_, expected_, now, bag);
  const Gate& gate = buffer_.gate(buffer_.newest());
  return lacks(gate, expected_from(gate, id_), now, bag);
}

// Whoever this world has mattered to. A ghost that matters to nobody would have been absorbed.
std::vector<kernel::LpId> World::disappoints() const {
  const Expected expected = expected_from(buffer_.gate(buffer_.newest()), id_);
  std::vector<WorldId> worlds = expected.ghosts_to;
  worlds.insert(worlds.end(), expected.fragments_to.begin(), expected.fragments_to.end());
  sort_unique(worlds);
  std::vector<kernel::LpId> lps;
  for (const WorldId world : worlds) lps.push_back(kernel::LpId{index_of(world)});
  return lps;
}

// One merge round: take in records, pass on what others lack. Round 0 takes in fragments. In
// further passes nobody is waited for.
void World::sync(kernel::VirtualTime now, Bag bag, kernel::Outbox& outbox) {
  const std::uint32_t round = merge_round_of(now), pass = pass_of(now);
  for (const kernel::MessageView& message : bag) {
    const WorldId from{kernel::index_of(message.source)};
    if (message.kind == static_cast<std::uint32_t>(MessageKind::kFragments))
      take_in_fragment(pass, from, decode_fragment(message.payload));
    else
      take_in_records(pass, round, from, decode_records(message.payload));
  }
  counters_.merge_rounds += !bag.empty();
  memo_.connects = memo_.connects || pass > 0;
  const std::vector<physics::BodyState> started =
      pass > 0 ? states_at_start() : std::vector<physics::BodyState>{};
  std::map<WorldId, Records> outgoing =
      outgoing_records(round, id_, known_bodies(ids_, id_, merge_), pass > 0 ? started : states_,
                       scratch_.manifolds, merge_);
  if (around_.gating && pass == 0)
    for (const auto& [partner, records] : outgoing)
      next_gate_.told.emplace_back(round + 1, partner);
  for (const auto& [told, world] : gate_.told)
    if (pass == 0 && told == round + 1) outgoing[world];
  for (const auto& [partner, records] : outgoing) {
    counters_.records_sent += records.nodes.size() + records.manifolds.size();
    send(partner, time_of(now.t, Phase::kSync, round + 1, pass), MessageKind::kRecords,
         encode_records(records), outbox);
  }
  next_ = pass > 0 ? time_of(now.t, Phase::kSolve, 0, pass)
                   : after_round(now.t, next_round(gate_, expected_, round + 1));
}

void World::take_in_fragment(std::uint32_t pass, WorldId from, const Fragment& fragment) {
  if (around_.gating && pass == 0 && !fragment.records.manifolds.empty())
    next_gate_.testers.push_back(from);
  take_fragment(ids_, id_, from, fragment, gate_.groups, merge_, scratch_.manifolds);
}

void World::take_in_records(std::uint32_t pass, std::uint32_t round, WorldId from,
                            const Records& records) {
  const bool has_news = !records.nodes.empty() || !records.manifolds.empty();
  if (around_.gating && pass == 0 && has_news) next_gate_.heard.emplace_back(round, from);
  add_records(ids_, from, records, merge_, scratch_.manifolds);
}

kernel::VirtualTime World::after_round(std::int64_t step, std::uint32_t next) const {
  if (next != kNoRound) return time_of(step, Phase::kSync, next);
  return time_of(step, may_split() ? Phase::kSplit : Phase::kSolve);
}

}  // namespace soda::models
