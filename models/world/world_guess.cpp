// Ghosts that a world guesses while it has not been told of them, and what it leaves for guesses.
#include <algorithm>
#include <iterator>
#include <set>
#include <tuple>
#include <utility>

#include "models/world/absorption.hpp"
#include "models/world/world.hpp"

namespace soda::models {

namespace {

Heard heard_in(std::span<const kernel::MessageView> bag) {
  Heard heard;
  for (const kernel::MessageView& message : bag) {
    add_world(WorldId{kernel::index_of(message.source)}, heard.from);
    decode_ghosts(message.payload, heard.ghosts);
  }
  return heard;
}

// Without the guesses.
Heard spoken(Heard heard) {
  std::erase_if(heard.ghosts, [&heard](const Ghost& ghost) {
    return !std::binary_search(heard.from.begin(), heard.from.end(), ghost.owner);
  });
  return heard;
}

std::span<const Ghost> of_owner(std::span<const Ghost> ghosts, WorldId owner) {
  const auto by_owner = [](const Ghost& a, const Ghost& b) { return a.owner < b.owner; };
  const auto [first, last] =
      std::equal_range(ghosts.begin(), ghosts.end(), Ghost{{}, owner, {}, {}}, by_owner);
  return {first, last};
}

}  // namespace

// Whoever has sent ghosts of the step knows better than any guess.
Heard World::completed(const Rules& rules, const ForeignView& before, Heard heard) {
  const std::vector<Ghost> guesses =
      guess_ghosts(around_.ghosts, rules, around_.geometry, id_, before, heard.from, stages_);
  counters_.ghosts_guessed += guesses.size();
  heard.ghosts.insert(heard.ghosts.end(), guesses.begin(), guesses.end());
  std::sort(heard.ghosts.begin(), heard.ghosts.end(), [](const Ghost& a, const Ghost& b) {
    return std::tie(a.owner, a.id) < std::tie(b.owner, b.id);
  });
  return heard;
}

std::vector<Ghost> World::ghosts_and_guesses(std::int64_t step, Bag bag) {
  next_view_.heard = completed(rules_, buffer_.view(step), heard_in(bag));
  audit_guesses(step, next_view_.heard);
  return next_view_.heard.ghosts;
}

// The same for a step that had been executed with the ghosts `was`, when `before` differed in the
// ghosts `changed` only: each body's guess is a function of what was known of that body alone.
Heard World::completed_again(const Rules& rules, const ForeignView& before,
                             std::span<const physics::BodyId> changed, const Heard& was,
                             Heard heard) {
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

// A late answer. What it changes of its own step changes the guesses of later steps: all of them
// have to come out as they did.
bool World::absorb_with_guesses(std::int64_t from, Bag bag) {
  std::vector<std::pair<Heard, std::vector<Ghost>>> steps;
  std::vector<physics::BodyId> changed;
  ForeignView before = buffer_.view(from);
  Heard heard = heard_in(bag);
  const std::int64_t after = next_.t + (next_ > time_of(next_.t, Phase::kBorderTraversal));
  for (std::int64_t step = from; step < after; ++step) {
    const bool is_over = step < next_.t;
    const Rules& rules = is_over ? buffer_.rules(step + 1) : rules_;
    const ForeignView& was = is_over ? buffer_.view(step + 1) : next_view_;
    if (step > from) heard = spoken(was.heard);
    const bool same_speakers = news_from(before) == news_from(buffer_.view(step));
    const bool only_more = std::includes(heard.from.begin(), heard.from.end(),
                                         was.heard.from.begin(), was.heard.from.end());
    heard = same_speakers && only_more
                ? completed_again(rules, before, changed, was.heard, std::move(heard))
                : completed(rules, before, std::move(heard));
    changed = differing(was.heard.ghosts, heard.ghosts);
    std::vector<Ghost> usable = foreign_ghosts(heard.ghosts, own_bodies(step));
    if (!changed.empty() && !comes_out_alike(step, usable)) return false;
    before = was;
    before.heard = heard;
    steps.emplace_back(std::move(heard), std::move(usable));
    if (changed.empty()) break;
  }
  for (auto& [now_heard, usable] : steps)
    adopt_ghosts(from++, std::move(now_heard), std::move(usable));
  ++counters_.bags_absorbed;
  return true;
}

void World::adopt_ghosts(std::int64_t step, Heard heard, std::vector<Ghost> usable) {
  audit_guesses(step, heard);
  if (step == next_.t) {
    next_view_.heard = std::move(heard);
    ghosts_ = usable;
    memo_.ghosts = std::move(usable);
    return;
  }
  const std::int64_t end = step + 1;
  if (!differing(buffer_.view(end).heard.ghosts, heard.ghosts).empty()) {
    // A stale entry after it was computed from what is replaced here.
    buffer_.frame_differs(end) = true;
    buffer_.replace_ghosts(end, std::move(usable));
  }
  buffer_.replace_heard(end, std::move(heard));
}

void World::audit_guesses(std::int64_t step, const Heard& heard) {
  if (!audits()) return;
  for (const WorldId world : heard.from)
    audit_.note_news(step, world, of_owner(heard.ghosts, world), counters_);
  for (const WorldId world : news_from(buffer_.view(step)))
    if (!std::binary_search(heard.from.begin(), heard.from.end(), world))
      audit_.note_guess(step, world, of_owner(heard.ghosts, world));
}

// Of the gathered island, which has been solved here: of other foreign bodies this world does not
// know all contacts.
void World::note_known(std::span<const std::uint32_t> bodies, const KnownBodies& known) {
  if (around_.ghosts != GhostMode::kPredicted) return;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (known.place[bodies[i]] < 0)
      next_view_.known.push_back(
          {known.ids[bodies[i]], known.owners[bodies[i]], scratch_.island_states[i]});
}

void World::audit_contacts(std::int64_t step, const std::map<WorldId, Fragment>& fragments) {
  std::set<RecordKey> contacts;
  for (const auto& [target, fragment] : fragments)
    for (const physics::ContactManifold& manifold : fragment.records.manifolds)
      contacts.emplace(manifold.a, manifold.b);
  audit_.note_contacts(step, std::move(contacts));
}

}  // namespace soda::models
