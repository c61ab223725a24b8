#include "models/islands/dependencies.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace soda::models {
namespace {

using physics::BodyId;
using physics::ContactManifold;

// What is known of the islands that have one of the bodies.
Records records_around(std::span<const BodyId> bodies, const physics::Islands& islands,
                       const KnownGraph& known) {
  Records records;
  for (std::size_t i = 0; i < islands.count(); ++i) {
    const std::span<const std::uint32_t> members(&islands.bodies[islands.body_begin[i]],
                                                 islands.body_begin[i + 1] - islands.body_begin[i]);
    const bool concerned = std::any_of(members.begin(), members.end(), [&](std::uint32_t member) {
      return known.bodies.place[member] >= 0 &&
             std::binary_search(bodies.begin(), bodies.end(), known.bodies.ids[member]);
    });
    if (!concerned) continue;
    for (const std::uint32_t member : members) records.nodes.push_back(known.node(member));
    for (std::uint32_t m = islands.manifold_begin[i]; m < islands.manifold_begin[i + 1]; ++m)
      records.manifolds.push_back(known.manifolds[islands.manifolds[m]]);
  }
  std::sort(records.nodes.begin(), records.nodes.end(),
            [](const Node& x, const Node& y) { return x.id < y.id; });
  std::sort(records.manifolds.begin(), records.manifolds.end(), canonical_before);
  return records;
}

void take_out(const Records& known, Records& records) {
  std::erase_if(records.manifolds, [&](const ContactManifold& manifold) {
    return std::binary_search(known.manifolds.begin(), known.manifolds.end(), manifold,
                              canonical_before);
  });
  std::set<BodyId> needed;
  for (const ContactManifold& manifold : records.manifolds) needed.insert({manifold.a, manifold.b});
  std::erase_if(records.nodes, [&](const Node& node) { return !needed.contains(node.id); });
}

const MixedGroup* find_group(std::span<const MixedGroup> groups, BodyId label) {
  const auto place =
      std::lower_bound(groups.begin(), groups.end(), label,
                       [](const MixedGroup& group, BodyId wanted) { return group.label < wanted; });
  return place != groups.end() && place->label == label ? &*place : nullptr;
}

}  // namespace

void note_group(std::span<const BodyId> ids, std::span<const WorldId> owners, WorldId self,
                std::vector<MixedGroup>& groups) {
  MixedGroup group{ids.front(), {owners.begin(), owners.end()}, {}};
  sort_unique(group.owners);
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (owners[i] == self) group.own.push_back(ids[i]);
  if (group.owners.size() > 1 && !group.own.empty()) groups.push_back(std::move(group));
}

void sort_unique(std::vector<WorldId>& worlds) {
  std::sort(worlds.begin(), worlds.end());
  worlds.erase(std::unique(worlds.begin(), worlds.end()), worlds.end());
}

Expected expected_from(const Dependencies& dependencies, WorldId self) {
  std::set<WorldId> partners;
  for (const MixedGroup& group : dependencies.groups)
    partners.insert(group.owners.begin(), group.owners.end());
  partners.erase(self);
  const auto partners_and = [&](std::span<const WorldId> others) {
    std::set<WorldId> all = partners;
    all.insert(others.begin(), others.end());
    return std::vector<WorldId>(all.begin(), all.end());
  };
  return {.migrants = dependencies.migrants,
          .ghosts_to = partners_and(dependencies.testers),
          .ghosts_from = partners_and(dependencies.tested_for),
          .fragments_to = partners_and(dependencies.tested_for),
          .fragments_from = partners_and(dependencies.testers)};
}

std::vector<WorldId> concerned(const Dependencies& dependencies, WorldId self,
                               std::span<const BodyId> bodies) {
  std::set<WorldId> worlds;
  if (!bodies.empty()) worlds.insert(dependencies.testers.begin(), dependencies.testers.end());
  for (const MixedGroup& group : dependencies.groups) {
    const bool changes = std::any_of(group.own.begin(), group.own.end(), [&](BodyId id) {
      return std::binary_search(bodies.begin(), bodies.end(), id);
    });
    if (changes) worlds.insert(group.owners.begin(), group.owners.end());
  }
  worlds.erase(self);
  return {worlds.begin(), worlds.end()};
}

std::uint32_t next_round(const Dependencies& dependencies, const Expected& expected,
                         std::uint32_t round) {
  std::uint32_t next = kNoRound;
  if (round == 0 && !expected.fragments_from.empty()) next = 0;
  for (const auto& [received, world] : dependencies.received)
    if (received >= round) next = std::min(next, received);
  for (const auto& [sent, world] : dependencies.sent)  // sent in the round before
    if (sent > round) next = std::min(next, sent - 1);
  return next;
}

bool lacks(const Dependencies& dependencies, const Expected& expected, kernel::VirtualTime now,
           std::span<const kernel::MessageView> bag) {
  const auto is_missing = [&](WorldId from, MessageKind kind) {
    return std::none_of(bag.begin(), bag.end(), [&](const kernel::MessageView& message) {
      return kernel::index_of(message.source) == index_of(from) &&
             message.kind == static_cast<std::uint32_t>(kind);
    });
  };
  const auto any_missing = [&](std::span<const WorldId> worlds, MessageKind kind) {
    return std::any_of(worlds.begin(), worlds.end(),
                       [&](WorldId world) { return is_missing(world, kind); });
  };
  if (phase_of(now) == Phase::kBegin) return any_missing(expected.migrants, MessageKind::kMigrants);
  if (phase_of(now) == Phase::kBorderTraversal)
    return any_missing(expected.ghosts_from, MessageKind::kGhosts);
  if (phase_of(now) != Phase::kSync) return false;
  if (merge_round_of(now) == 0)
    return any_missing(expected.fragments_from, MessageKind::kFragments);
  return std::any_of(dependencies.received.begin(), dependencies.received.end(),
                     [&](const auto& received) {
                       return received.first == merge_round_of(now) &&
                              is_missing(received.second, MessageKind::kRecords);
                     });
}

void add_group_fragments(std::span<const MixedGroup> groups, WorldId self, const KnownGraph& known,
                         std::map<WorldId, Fragment>& fragments) {
  physics::Islands islands;
  physics::build_islands(known.bodies.ids, known.manifolds, islands);
  for (const MixedGroup& group : groups) {
    const Records records = records_around(group.own, islands, known);
    for (const WorldId owner : group.owners) {
      if (owner == self) continue;
      Fragment& fragment = fragments[owner];
      take_out(records, fragment.records);
      fragment.groups.push_back({group.label, records});
    }
  }
}

void take_fragment(std::span<const BodyId> own_ids, WorldId self, const ReceivedFragment& received,
                   std::span<const MixedGroup> groups, IslandMerge& merge,
                   std::vector<ContactManifold>& manifolds) {
  const auto& [from, fragment] = received;
  add_fragment(own_ids, from, fragment.records, merge, manifolds);
  for (const Fragment::OfGroup& part : fragment.groups) {
    add_records(own_ids, from, part.records, merge, manifolds);
    const MixedGroup* const group = find_group(groups, part.label);
    if (group == nullptr) continue;
    for (const WorldId owner : group->owners)
      if (owner != self && owner != received.from) note_exchanged(part.records, owner, merge);
  }
}

}  // namespace soda::models
