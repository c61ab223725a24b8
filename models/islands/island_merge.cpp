#include "models/islands/island_merge.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>

#include "physics/math/gallop.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::ContactManifold;

RecordKey key_of(const ContactManifold& manifold) { return {manifold.a, manifold.b}; }

bool contains(std::span<const BodyId> ascending, BodyId id) {
  return std::binary_search(ascending.begin(), ascending.end(), id);
}

auto find_node(const IslandMerge& merge, BodyId id) {
  return std::lower_bound(merge.nodes.begin(), merge.nodes.end(), id,
                          [](const Node& node, BodyId wanted) { return node.id < wanted; });
}

bool knows(std::span<const BodyId> own_ids, const IslandMerge& merge, BodyId id) {
  if (physics::is_static(id) || contains(own_ids, id)) return true;
  const auto node = find_node(merge, id);
  return node != merge.nodes.end() && node->id == id;
}

bool pair_is_known(std::span<const ContactManifold> manifolds, const RecordKey& key) {
  const auto place = std::lower_bound(
      manifolds.begin(), manifolds.end(), key,
      [](const ContactManifold& manifold, const RecordKey& k) { return key_of(manifold) < k; });
  return place != manifolds.end() && key_of(*place) == key;
}

// One island of the known graph.
struct IslandView {
  std::span<const std::uint32_t> bodies;        // into known.ids
  std::span<const std::uint32_t> manifolds;     // into the manifolds
  std::vector<std::array<WorldId, 2>> sides{};  // per manifold, the owners of its bodies
};

// A static belongs to whom it touches.
void find_sides(const KnownBodies& known, std::span<const ContactManifold> manifolds,
                IslandView& island) {
  const auto owner = [&](auto at) {
    return known.owners[static_cast<std::size_t>(at - known.ids.begin())];
  };
  island.sides.reserve(island.manifolds.size());
  auto a = known.ids.begin();  // the manifolds ascend by it
  for (const std::uint32_t m : island.manifolds) {
    const ContactManifold& manifold = manifolds[m];
    a = physics::gallop(a, known.ids.end(), manifold.a);
    island.sides.push_back(
        {owner(a), physics::is_static(manifold.b)
                       ? owner(a)
                       : owner(physics::gallop(a, known.ids.end(), manifold.b))});
  }
}

std::set<WorldId> owners_in(const KnownBodies& known, const IslandView& island) {
  std::set<WorldId> owners;
  for (const std::uint32_t body : island.bodies) owners.insert(known.owners[body]);
  return owners;
}

// Foreign owners with a body in contact with a body of `self`.
std::set<WorldId> partners(const IslandView& island, WorldId self) {
  std::set<WorldId> out;
  for (const auto& [a, b] : island.sides) {
    if (a == self && b != self) out.insert(b);
    if (b == self && a != self) out.insert(a);
  }
  return out;
}

// Asked for ascending keys.
class Lookup {
 public:
  explicit Lookup(const RecordSet& records) : at_(records.begin()), end_(records.end()) {}

  bool contains(const RecordKey& key) {
    at_ = physics::gallop(at_, end_, key);
    return at_ != end_ && *at_ == key;
  }

 private:
  std::vector<RecordKey>::const_iterator at_, end_;
};

Records missing_records(const KnownGraph& known, const IslandView& island, WorldId partner,
                        RecordSet& exchanged) {
  Records records;
  std::vector<RecordKey> keys;
  Lookup had_bodies{exchanged}, had_pairs{exchanged};
  for (const std::uint32_t body : island.bodies) {
    const BodyId id = known.bodies.ids[body];
    if (known.bodies.owners[body] == partner || had_bodies.contains({id, id})) continue;
    keys.push_back({id, id});
    records.nodes.push_back(known.node(body));
  }
  for (std::size_t i = 0; i < island.manifolds.size(); ++i) {
    const ContactManifold& manifold = known.manifolds[island.manifolds[i]];
    if (island.sides[i][0] == partner || island.sides[i][1] == partner) continue;
    if (had_pairs.contains(key_of(manifold))) continue;
    keys.push_back(key_of(manifold));
    records.manifolds.push_back(manifold);
  }
  exchanged.insert(std::move(keys));
  return records;
}

// A pair that no other world has to test. One that has sent a contact of it holds a body for its
// own that has come here, or has come back: what it says is not true, and an island of own bodies
// must be a function of their states, for a repetition takes it over by them.
bool is_tested_here(std::span<const BodyId> own_ids, const ContactManifold& manifold) {
  return contains(own_ids, manifold.a) &&
         (physics::is_static(manifold.b) || contains(own_ids, manifold.b));
}

void add_nodes(std::span<const BodyId> own_ids, std::span<const Node> nodes, IslandMerge& merge) {
  std::vector<Node> added;
  for (const Node& node : nodes)
    if (!knows(own_ids, merge, node.id)) added.push_back(node);
  if (added.empty()) return;
  std::ranges::stable_sort(added, {}, &Node::id);
  const auto same = [](const Node& x, const Node& y) { return x.id == y.id; };
  added.erase(std::unique(added.begin(), added.end(), same), added.end());
  const std::ptrdiff_t known = std::ssize(merge.nodes);
  std::ranges::move(added, std::back_inserter(merge.nodes));
  std::ranges::inplace_merge(merge.nodes, merge.nodes.begin() + known, {}, &Node::id);
}

// Adds what is not known yet.
void take_in(std::span<const BodyId> own_ids, const Records& records, IslandMerge& merge,
             std::vector<ContactManifold>& manifolds) {
  add_nodes(own_ids, records.nodes, merge);
  std::vector<ContactManifold> added;
  for (const ContactManifold& manifold : records.manifolds) {
    if (is_tested_here(own_ids, manifold) || pair_is_known(manifolds, key_of(manifold))) continue;
    if (knows(own_ids, merge, manifold.a) && knows(own_ids, merge, manifold.b))
      added.push_back(manifold);
  }
  if (added.empty()) return;
  std::ranges::sort(added, canonical_before);
  const std::ptrdiff_t known = std::ssize(manifolds);
  manifolds.insert(manifolds.end(), added.begin(), added.end());
  std::inplace_merge(manifolds.begin(), manifolds.begin() + known, manifolds.end(),
                     canonical_before);
}

// The islands of one world are disjoint, so appending keeps no order: sort once at the end.
void append(Records&& from, Records& to) {
  std::move(from.nodes.begin(), from.nodes.end(), std::back_inserter(to.nodes));
  to.manifolds.insert(to.manifolds.end(), from.manifolds.begin(), from.manifolds.end());
}

}  // namespace

void RecordSet::insert(std::vector<RecordKey> keys) {
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<RecordKey> all;
  all.reserve(keys_.size() + keys.size());
  std::ranges::set_union(keys_, keys, std::back_inserter(all));
  keys_ = std::move(all);
}

void add_node(std::span<const BodyId> own_ids, const Node& node, IslandMerge& merge) {
  add_nodes(own_ids, {&node, 1}, merge);
}

void note_exchanged(const Records& records, WorldId with, IslandMerge& merge) {
  std::vector<RecordKey> keys;
  for (const Node& node : records.nodes) keys.push_back({node.id, node.id});
  for (const ContactManifold& manifold : records.manifolds) keys.push_back(key_of(manifold));
  merge.exchanged[with].insert(std::move(keys));
}

void add_records(std::span<const BodyId> own_ids, WorldId from, const Records& records,
                 IslandMerge& merge, std::vector<ContactManifold>& manifolds) {
  note_exchanged(records, from, merge);
  take_in(own_ids, records, merge, manifolds);
}

void add_fragment(std::span<const BodyId> own_ids, WorldId from, const Records& records,
                  IslandMerge& merge, std::vector<ContactManifold>& manifolds) {
  std::map<WorldId, std::vector<RecordKey>> exchanged;
  std::map<BodyId, WorldId> owners;
  for (const Node& node : records.nodes) {
    owners.emplace(node.id, node.owner);
    if (node.owner == from) exchanged[from].push_back({node.id, node.id});
  }
  for (const ContactManifold& manifold : records.manifolds) {
    for (const auto& [own, other] :
         {std::pair(manifold.a, manifold.b), std::pair(manifold.b, manifold.a)}) {
      const auto owner = owners.find(other);
      if (owner == owners.end()) continue;
      std::vector<RecordKey>& with_owner = exchanged[owner->second];
      with_owner.push_back(key_of(manifold));
      if (contains(own_ids, own)) with_owner.push_back({own, own});
    }
  }
  for (auto& [world, keys] : exchanged) merge.exchanged[world].insert(std::move(keys));
  take_in(own_ids, records, merge, manifolds);
}

KnownBodies known_bodies(std::span<const BodyId> own_ids, WorldId self, const IslandMerge& merge) {
  KnownBodies known;
  const std::size_t count = own_ids.size() + merge.nodes.size();
  known.ids.reserve(count);
  known.owners.reserve(count);
  known.place.reserve(count);
  std::size_t own = 0, node = 0;
  while (own < own_ids.size() || node < merge.nodes.size()) {
    const bool take_own =
        node == merge.nodes.size() || (own < own_ids.size() && own_ids[own] < merge.nodes[node].id);
    known.ids.push_back(take_own ? own_ids[own] : merge.nodes[node].id);
    known.owners.push_back(take_own ? self : merge.nodes[node].owner);
    known.place.push_back(take_own ? static_cast<std::int32_t>(own++)
                                   : -1 - static_cast<std::int32_t>(node++));
  }
  return known;
}

std::map<WorldId, Records> outgoing_records(std::uint32_t round, WorldId self,
                                            const KnownBodies& known,
                                            std::span<const physics::BodyState> own_states,
                                            std::span<const ContactManifold> manifolds,
                                            IslandMerge& merge) {
  const KnownGraph graph{known, own_states, merge.nodes, manifolds};
  physics::Islands islands;
  physics::build_islands(known.ids, manifolds, islands);
  std::map<WorldId, Records> outgoing;
  for (std::size_t i = 0; i < islands.count(); ++i) {
    IslandView island{
        {&islands.bodies[islands.body_begin[i]], islands.body_begin[i + 1] - islands.body_begin[i]},
        {&islands.manifolds[islands.manifold_begin[i]],
         islands.manifold_begin[i + 1] - islands.manifold_begin[i]}};
    const std::set<WorldId> owners = owners_in(known, island);
    if (owners.size() < 2 || !owners.contains(self)) continue;
    if (round >= 1 && owners.size() <= round) continue;
    find_sides(known, manifolds, island);
    for (const WorldId partner : partners(island, self)) {
      append(missing_records(graph, island, partner, merge.exchanged[partner]), outgoing[partner]);
    }
  }
  std::erase_if(outgoing, [](const auto& item) {
    return item.second.nodes.empty() && item.second.manifolds.empty();
  });
  for (auto& [partner, records] : outgoing) {
    std::sort(records.nodes.begin(), records.nodes.end(),
              [](const Node& x, const Node& y) { return x.id < y.id; });
    std::sort(records.manifolds.begin(), records.manifolds.end(), canonical_before);
  }
  return outgoing;
}

}  // namespace soda::models
