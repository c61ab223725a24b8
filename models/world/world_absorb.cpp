// Late ghosts that touch nothing: what a world has executed stands.
#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "models/world/absorption.hpp"
#include "models/world/world.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;

template <class Packed>
std::optional<BodyState> unpacked(const Packed& state) {
  std::optional<BodyState> result(std::in_place);
  state.unpack(*result);
  return result;
}

std::optional<BodyId> contact_of(const SharedList<physics::ContactManifold>& tested, BodyId id) {
  if (const physics::ContactManifold* const first = tested.find(id)) return first->b;
  std::optional<BodyId> other;
  tested.for_each([&other, id](const auto& m) {
    if (m.b == id) other = m.a;
  });
  return other;
}

// Of a step whose memo is open. `start`, the entry that it began from, is stored: its bodies were
// copied out.
void look_into(const StepMemo& memo, const StoredEntry& start, ExecutedStep& step) {
  step.ghosts = memo.ghosts;
  step.begin_state = [&memo, &start](BodyId id) -> std::optional<BodyState> {
    if (std::ranges::binary_search(memo.touched, id)) return std::nullopt;
    const auto migrant = std::ranges::lower_bound(memo.migrants, id, {}, &Migrant::id);
    if (migrant != memo.migrants.end() && migrant->id == id) return migrant->state;
    const StoredBody* const body = start.bodies.find(id);
    return body == nullptr ? std::nullopt : unpacked(body->state);
  };
  step.border_bodies = [&memo](std::uint32_t cell) -> std::span<const StepMemo::BorderBody> {
    const auto of = &StepMemo::BorderBody::cell;
    return {std::ranges::lower_bound(memo.border, cell, {}, of),
            std::ranges::upper_bound(memo.border, cell, {}, of)};
  };
  step.sent = memo.sent;
  step.connects = memo.connects;
  step.contacts = memo.tested.size();
  step.contact_of = [&memo](BodyId id) { return contact_of(memo.tested, id); };
}

// Of a step that wrote `end`; `ghosts` are its, and must last.
void look_into(const StoredEntry& end, std::span<const Ghost> ghosts, const StoredEntry& start,
               ExecutedStep& step) {
  step.ghosts = ghosts;
  step.begin_state = [&end, &start](BodyId id) -> std::optional<BodyState> {
    if (std::ranges::binary_search(end.touched, id)) return std::nullopt;
    if (const StoredMigrant* const migrant = end.migrants.find(id)) return unpacked(migrant->state);
    const StoredBody* const body = start.bodies.find(id);
    return body == nullptr ? std::nullopt : unpacked(body->state);
  };
  step.border_bodies = [&end](std::uint32_t cell) { return end.border.range(cell); };
  step.sent = end.sent;
  step.connects = end.memo_connects;
  step.contacts = end.tested.size();
  step.contact_of = [&end](BodyId id) { return contact_of(end.tested, id); };
}

}  // namespace

// Whose bodies they are during a step that has begun. What it refers to are its own bodies now, or
// those of the entry that it has written.
std::function<bool(BodyId)> World::own_bodies(std::int64_t step) const {
  const bool is_over = step < next_.t;
  if (const StoredEntry* const end = is_over ? buffer_.stored(step + 1) : nullptr)
    return [end](BodyId id) { return end->bodies.find(id) != nullptr; };
  const std::span<const BodyId> ids = is_over ? buffer_.open(step + 1)->ids : ids_;
  return [ids](BodyId id) { return std::binary_search(ids.begin(), ids.end(), id); };
}

// Of a step whose pairs have been tested; none if its memo is gone. `ghosts` is memory for what it
// refers to.
std::optional<ExecutedStep> World::executed_step(std::int64_t step,
                                                 std::vector<Ghost>& ghosts) const {
  const bool is_over = step < next_.t;
  const StoredEntry* const start = buffer_.stored(step);
  const BufferEntry* const open = is_over ? buffer_.open(step + 1) : nullptr;
  const StoredEntry* const end = is_over ? buffer_.stored(step + 1) : nullptr;
  const StepMemo& memo = open != nullptr ? open->memo : memo_;
  if (start == nullptr || !(end != nullptr ? end->memo_valid : memo.valid)) return std::nullopt;
  const Rules& rules = is_over ? buffer_.rules(step + 1) : rules_;
  ExecutedStep executed{.map = *rules.map,
                        .scene = *rules.scene,
                        .geometry = around_.geometry,
                        .self = id_,
                        .ghosts = {},
                        .is_own = own_bodies(step),
                        .begin_state = {},
                        .border_bodies = {},
                        .sent = {},
                        .connects = false,
                        .contacts = 0,
                        .contact_of = {}};
  if (end != nullptr) {
    ghosts = load_ghosts(*end);
    look_into(*end, ghosts, *start, executed);
  } else {
    look_into(memo, *start, executed);
  }
  return executed;
}

// Whether the step, of which `usable` are the ghosts now, stands as it was executed. Where the
// pairs have not been tested yet, nothing has been made of the ghosts.
bool World::comes_out_alike(std::int64_t step, std::span<const Ghost> usable) {
  if (step == next_.t && next_ <= time_of(step, Phase::kPairs)) return true;
  std::vector<Ghost> before;
  const std::optional<ExecutedStep> executed = executed_step(step, before);
  return executed &&
         makes_no_difference(*executed, usable, stages_, counters_.absorption_looks, refusal_);
}

// Late news of further passes, of a step that is over, from the owner: what is passed on comes near
// an own body, if elsewhere.
bool World::absorb_sent(kernel::VirtualTime now, Bag bag) {
  std::vector<Ghost> before;
  const std::optional<ExecutedStep> executed = executed_step(now.t, before);
  if (!executed) return false;
  std::vector<StepMemo::SentWay> ways;
  for (const kernel::MessageView& message : bag) {
    std::vector<SentBody> sent;
    decode_sent(message.payload, sent);
    for (const SentBody& body : sent) {
      const Ghost& ghost = body.ghost;
      if (executed->is_own(ghost.id) ||
          !is_out_of_reach(*executed, ghost, counters_.absorption_looks))
        return false;
      ways.push_back({ghost.owner, ghost.box});
    }
  }
  buffer_.add_sent(now.t + 1, ways);
  ++counters_.bags_absorbed;
  return true;
}

// Late ghosts of a step whose pairs have been tested.
bool World::absorb(kernel::VirtualTime now, Bag bag) {
  refusal_ = {};
  if (phase_of(now) != Phase::kBorderTraversal || bag.empty()) return false;
  if (pass_of(now) > 0) return now.t < next_.t && absorb_sent(now, bag);
  if (guesses()) return absorb_with_guesses(now.t, bag);
  const bool is_over = next_.t > now.t;
  if (!is_over && next_ <= time_of(now.t, Phase::kPairs)) return false;
  std::vector<Ghost> ghosts;
  for (const kernel::MessageView& message : bag) decode_ghosts(message.payload, ghosts);
  ghosts = foreign_ghosts(std::move(ghosts), own_bodies(now.t));
  if (!comes_out_alike(now.t, ghosts)) return false;
  ++counters_.bags_absorbed;
  if (!is_over) ghosts_ = ghosts;
  if (is_over)
    buffer_.replace_ghosts(now.t + 1, std::move(ghosts));
  else
    memo_.ghosts = std::move(ghosts);
  return true;
}

}  // namespace soda::models
