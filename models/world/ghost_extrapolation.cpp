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

Heard ghosts_in(Bag bag) {
  Heard heard;
  for (const kernel::MessageView& message : bag) {
    add_world(WorldId{kernel::index_of(message.source)}, heard.from);
    decode_ghosts(message.payload, heard.ghosts);
  }
  return heard;
}

void GhostExtrapolation::start(const ForeignView& before, bool audits) {
  owed_ = before.told;
  audits_ = audits;
  view_ = {};
}

void GhostExtrapolation::note_migrants_from(std::span<const WorldId> sources) {
  if (!is_on()) return;
  for (const WorldId source : sources) add_world(source, owed_);
}

std::vector<Ghost> GhostExtrapolation::complete(std::int64_t step, Bag bag,
                                                const ForeignView& before) {
  view_.heard = completed(step_.rules, before, ghosts_in(bag));
  audit(step, before, view_.heard);
  return view_.heard.ghosts;
}

Heard GhostExtrapolation::completed(const Rules& rules, const ForeignView& before, Heard heard) {
  const std::vector<Ghost> guesses =
      guess_ghosts(step_.around.ghosts, rules, step_.around.geometry, step_.self, before,
                   heard.from, step_.work.stages);
  step_.work.worlds.ghosts_guessed += guesses.size();
  heard.ghosts.insert(heard.ghosts.end(), guesses.begin(), guesses.end());
  std::sort(heard.ghosts.begin(), heard.ghosts.end(), [](const Ghost& a, const Ghost& b) {
    return std::tie(a.owner, a.id) < std::tie(b.owner, b.id);
  });
  return heard;
}

Heard GhostExtrapolation::completed_again(const Rules& rules, const ForeignView& before,
                                          std::span<const physics::BodyId> changed,
                                          const Heard& was, Heard heard) {
  const auto has_changed = [changed](const auto& body) {
    return std::binary_search(changed.begin(), changed.end(), body.id);
  };
  ForeignView concerned;
  concerned.sent_to = news_from(before);
  std::copy_if(before.heard.ghosts.begin(), before.heard.ghosts.end(),
               std::back_inserter(concerned.heard.ghosts), has_changed);
  std::copy_if(before.known.begin(), before.known.end(), std::back_inserter(concerned.known),
               has_changed);
  for (const Ghost& ghost : was.ghosts) {
    const auto is = [&ghost](std::span<const WorldId> worlds) {
      return std::binary_search(worlds.begin(), worlds.end(), ghost.owner);
    };
    if (!is(was.from) && !is(heard.from) && !has_changed(ghost)) heard.ghosts.push_back(ghost);
  }
  return completed(rules, concerned, std::move(heard));
}

void GhostExtrapolation::audit(std::int64_t step, const ForeignView& before, const Heard& heard) {
  if (!audits_) return;
  for (const WorldId world : heard.from)
    audit_.note_news(step, world, of_owner(heard.ghosts, world), step_.work.worlds);
  for (const WorldId world : news_from(before))
    if (!std::binary_search(heard.from.begin(), heard.from.end(), world))
      audit_.note_guess(step, world, of_owner(heard.ghosts, world));
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
  if (is_on()) view_.told.push_back(other);
}

void GhostExtrapolation::note_migrant_to(WorldId owner, physics::BodyId id,
                                         const physics::BodyState& state) {
  if (!is_on()) return;
  add_world(owner, view_.sent_to);
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
