#include "models/world/ghost_extrapolation.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <tuple>
#include <utility>

namespace soda::models {
namespace {

std::span<const Ghost> of_owner(std::span<const Ghost> ghosts, WorldId owner) {
  const auto by_owner = [](const Ghost& a, const Ghost& b) { return a.owner < b.owner; };
  const auto [first, last] =
      std::equal_range(ghosts.begin(), ghosts.end(), Ghost{{}, owner, {}, {}}, by_owner);
  return {first, last};
}

}  // namespace

ReceivedGhosts ghosts_in(Bag bag) {
  ReceivedGhosts received;
  for (const kernel::MessageView& message : bag) {
    add_world(WorldId{kernel::index_of(message.source)}, received.from);
    decode_ghosts(message.payload, received.ghosts);
  }
  return received;
}

void GhostExtrapolation::start(const ForeignView& before, bool audits) {
  pending_ = before.ghosts_sent_to;
  audits_ = audits;
  view_ = {};
}

void GhostExtrapolation::note_migrants_from(std::span<const WorldId> sources) {
  if (!is_on()) return;
  for (const WorldId source : sources) add_world(source, pending_);
}

std::vector<Ghost> GhostExtrapolation::complete(std::int64_t step, Bag bag,
                                                const ForeignView& before) {
  view_.received = completed(step_.rules, before, ghosts_in(bag));
  audit(step, before, view_.received);
  return view_.received.ghosts;
}

ReceivedGhosts GhostExtrapolation::completed(const Rules& rules, const ForeignView& before,
                                             ReceivedGhosts received) {
  const std::vector<Ghost> extrapolated =
      extrapolate_ghosts(step_.around.ghosts, rules, step_.around.geometry,
                         {step_.self, received.from}, before, step_.work.stages);
  step_.work.worlds.ghosts_guessed += extrapolated.size();
  received.ghosts.insert(received.ghosts.end(), extrapolated.begin(), extrapolated.end());
  std::sort(received.ghosts.begin(), received.ghosts.end(), [](const Ghost& a, const Ghost& b) {
    return std::tie(a.owner, a.id) < std::tie(b.owner, b.id);
  });
  return received;
}

ReceivedGhosts GhostExtrapolation::completed_again(const Rules& rules, const ForeignView& before,
                                                   std::span<const physics::BodyId> changed,
                                                   const ReceivedGhosts& was,
                                                   ReceivedGhosts received) {
  const auto has_changed = [changed](const auto& body) {
    return std::binary_search(changed.begin(), changed.end(), body.id);
  };
  ForeignView concerned;
  concerned.bodies_sent_to = news_from(before);
  std::copy_if(before.received.ghosts.begin(), before.received.ghosts.end(),
               std::back_inserter(concerned.received.ghosts), has_changed);
  std::copy_if(before.known.begin(), before.known.end(), std::back_inserter(concerned.known),
               has_changed);
  for (const Ghost& ghost : was.ghosts) {
    const auto is = [&ghost](std::span<const WorldId> worlds) {
      return std::binary_search(worlds.begin(), worlds.end(), ghost.owner);
    };
    if (!is(was.from) && !is(received.from) && !has_changed(ghost))
      received.ghosts.push_back(ghost);
  }
  return completed(rules, concerned, std::move(received));
}

void GhostExtrapolation::audit(std::int64_t step, const ForeignView& before,
                               const ReceivedGhosts& received) {
  if (!audits_) return;
  for (const WorldId world : received.from)
    audit_.note_news(step, world, of_owner(received.ghosts, world), step_.work.worlds);
  for (const WorldId world : news_from(before))
    if (!std::binary_search(received.from.begin(), received.from.end(), world))
      audit_.note_extrapolated(step, world, of_owner(received.ghosts, world));
}

void GhostExtrapolation::audit_contacts(std::int64_t step,
                                        const std::map<WorldId, Fragment>& fragments) {
  if (!audits_) return;
  std::set<RecordKey> contacts;
  for (const auto& [target, fragment] : fragments)
    for (const physics::ContactManifold& manifold : fragment.records.manifolds)
      contacts.emplace(manifold.a, manifold.b);
  audit_.note_contacts(step, std::move(contacts));
}

void GhostExtrapolation::note_ghosts_to(WorldId other) {
  if (is_on()) view_.ghosts_sent_to.push_back(other);
}

void GhostExtrapolation::note_migrant_to(WorldId owner, physics::BodyId id,
                                         const physics::BodyState& state) {
  if (!is_on()) return;
  add_world(owner, view_.bodies_sent_to);
  view_.known.push_back({id, owner, state});
}

void GhostExtrapolation::note_solved(std::span<const std::uint32_t> bodies,
                                     const KnownBodies& known) {
  if (step_.around.ghosts != GhostMode::kPredicted) return;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (known.place[bodies[i]] < 0)
      view_.known.push_back(
          {known.ids[bodies[i]], known.owners[bodies[i]], step_.scratch.island_states[i]});
}

void GhostExtrapolation::forget_solved() {
  std::erase_if(view_.known, [this](const Node& node) {
    return std::ranges::binary_search(step_.scratch.island_ids, node.id);
  });
}

}  // namespace soda::models
