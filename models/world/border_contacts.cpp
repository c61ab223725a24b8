#include "models/world/border_contacts.hpp"

#include <algorithm>

#include "models/islands/island_merge.hpp"

namespace soda::models {
namespace {

using physics::BodyState;
using physics::ContactManifold;

// Own bodies and ghosts as one ascending list.
struct Everybody {
  std::vector<physics::BodyId> ids;
  std::vector<WorldId> owners;
  std::vector<const BodyState*> states;
  std::vector<physics::Aabb> boxes;
};

Everybody everybody(const PresentBodies& present) {
  const auto& [self, ids, states, boxes, ghosts] = present;
  Everybody all;
  all.ids.reserve(ids.size() + ghosts.size());
  all.owners.reserve(ids.size() + ghosts.size());
  all.states.reserve(ids.size() + ghosts.size());
  all.boxes.reserve(ids.size() + ghosts.size());
  std::size_t own = 0, ghost = 0;
  while (own < ids.size() || ghost < ghosts.size()) {
    if (ghost == ghosts.size() || (own < ids.size() && ids[own] < ghosts[ghost].id)) {
      all.ids.push_back(ids[own]);
      all.owners.push_back(self);
      all.states.push_back(&states[own]);
      all.boxes.push_back(boxes[own++]);
    } else {
      all.ids.push_back(ghosts[ghost].id);
      all.owners.push_back(ghosts[ghost].owner);
      all.states.push_back(&ghosts[ghost].state);
      all.boxes.push_back(ghosts[ghost++].box);
    }
  }
  return all;
}

bool tests(const TerritoryMap& map, WorldId self, const Everybody& all, physics::IndexPair pair) {
  const WorldId a = all.owners[pair.first], b = all.owners[pair.second];
  if (a == b) return a == self;
  const physics::Vec3 corner = all.boxes[pair.first].min.cwiseMax(all.boxes[pair.second].min);
  return map.owner_at(corner) == self;
}

// The other owner receives the contact and the body that it does not own.
void add_fragment(const Everybody& all, std::uint32_t body, WorldId target,
                  std::span<const ContactManifold> found, std::map<WorldId, Fragment>& fragments) {
  Records& records = fragments[target].records;
  records.nodes.push_back({all.ids[body], all.owners[body], *all.states[body]});
  records.manifolds.insert(records.manifolds.end(), found.begin(), found.end());
}

// What was found of a pair of two owners, or of two ghosts.
void add_crossing(const Everybody& all, physics::IndexPair pair, WorldId self,
                  std::span<const ContactManifold> found, BorderContacts& out) {
  const WorldId a = all.owners[pair.first], b = all.owners[pair.second];
  if (a == self || b == self) {
    out.manifolds.insert(out.manifolds.end(), found.begin(), found.end());
    const std::uint32_t other = a == self ? pair.second : pair.first;
    out.foreign.push_back({all.ids[other], all.owners[other], *all.states[other]});
  } else {
    out.for_others.insert(out.for_others.end(), found.begin(), found.end());
  }
  if (b != self) add_fragment(all, pair.first, b, found, out.fragments);
  if (a != self) add_fragment(all, pair.second, a, found, out.fragments);
}

bool take_contacts(const KnownContacts& known, physics::BodyId a, physics::BodyId b,
                   std::vector<ContactManifold>& found, physics::StageCounters& counters) {
  if (known.repetition.take_contacts(a, b, found)) return true;
  const bool at_rest = known.resting.take_contacts(a, b, found);
  counters.pairs_at_rest += at_rest;
  return at_rest;
}

void sort_unique(std::vector<Node>& nodes) {
  std::stable_sort(nodes.begin(), nodes.end(),
                   [](const Node& x, const Node& y) { return x.id < y.id; });
  nodes.erase(std::unique(nodes.begin(), nodes.end(),
                          [](const Node& x, const Node& y) { return x.id == y.id; }),
              nodes.end());
}

}  // namespace

BorderContacts find_border_contacts(const physics::SceneDescription& scene,
                                    const physics::Geometry& geometry, const TerritoryMap& map,
                                    const PresentBodies& present, const KnownContacts& known,
                                    physics::StageCounters& counters) {
  const auto& [self, ids, states, boxes, ghosts] = present;
  const Everybody all = everybody(present);
  BorderContacts out;
  std::vector<physics::IndexPair> pairs, static_pairs;
  std::vector<ContactManifold> crossing;
  physics::find_pairs(scene.broadphase, all.boxes, pairs, counters);
  physics::find_static_pairs(geometry, boxes, static_pairs, counters);
  out.manifolds.reserve(pairs.size() + static_pairs.size());
  // Statics have the higher ids: per first body, its dynamic partners come before them. So the
  // manifolds come in canonical order.
  std::size_t p = 0, s = 0;
  while (p < pairs.size() || s < static_pairs.size()) {
    if (p == pairs.size() ||
        (s < static_pairs.size() && ids[static_pairs[s].first] < all.ids[pairs[p].first])) {
      const physics::IndexPair pair = static_pairs[s++];
      const physics::BodyId other = physics::static_id(pair.second);
      if (!take_contacts(known, ids[pair.first], other, out.manifolds, counters))
        physics::collide(
            {scene, geometry, scene.dt_s, ids[pair.first], states[pair.first], other, nullptr},
            out.manifolds, counters);
      continue;
    }
    const physics::IndexPair pair = pairs[p++];
    if (!tests(map, self, all, pair)) {
      ++out.pairs_of_others;
      continue;
    }
    const bool crosses = all.owners[pair.first] != self || all.owners[pair.second] != self;
    crossing.clear();
    std::vector<ContactManifold>& found = crosses ? crossing : out.manifolds;
    if (!take_contacts(known, all.ids[pair.first], all.ids[pair.second], found, counters))
      physics::collide({scene, geometry, scene.dt_s, all.ids[pair.first], *all.states[pair.first],
                        all.ids[pair.second], all.states[pair.second]},
                       found, counters);
    if (!crossing.empty()) add_crossing(all, pair, self, crossing, out);
  }
  physics::append_world_joints(scene, ids, states, out.manifolds);
  sort_unique(out.foreign);
  for (auto& [target, fragment] : out.fragments) sort_unique(fragment.records.nodes);
  return out;
}

}  // namespace soda::models
