#include "models/world/straggler_absorption.hpp"

#include <algorithm>
#include <utility>

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

// Without the extrapolated ghosts.
ReceivedGhosts received_only(ReceivedGhosts received) {
  std::erase_if(received.ghosts, [&received](const Ghost& ghost) {
    return !std::binary_search(received.from.begin(), received.from.end(), ghost.owner);
  });
  return received;
}

}  // namespace

bool StragglerAbsorption::absorb(kernel::VirtualTime now, Bag bag, kernel::VirtualTime next) {
  refusal_ = {};
  next_ = next;
  if (phase_of(now) != Phase::kBorderTraversal || bag.empty()) return false;
  const bool absorbed = pass_of(now) > 0         ? absorb_sent(now.t, bag)
                        : extrapolation_.is_on() ? absorb_with_extrapolation(now.t, bag)
                                                 : absorb_ghosts(now.t, bag);
  step_.work.worlds.bags_absorbed += absorbed;
  return absorbed;
}

// Late ghosts of a step whose pairs have been tested.
bool StragglerAbsorption::absorb_ghosts(std::int64_t step, Bag bag) {
  if (!is_over(step) && next_ <= time_of(step, Phase::kPairs)) return false;
  std::vector<Ghost> ghosts = foreign_ghosts(ghosts_in(bag).ghosts, own_bodies(step));
  if (!comes_out_alike(step, ghosts)) return false;
  if (is_over(step)) {
    buffer_.replace_ghosts(step + 1, std::move(ghosts));
  } else {
    step_.ghosts = ghosts;
    step_.memo.ghosts = std::move(ghosts);
  }
  return true;
}

// Late news of further passes, of a step that is over, from the owner: what is passed on comes near
// an own body, if elsewhere.
bool StragglerAbsorption::absorb_sent(std::int64_t step, Bag bag) {
  if (!is_over(step)) return false;
  std::vector<Ghost> before;
  const std::optional<ExecutedStep> executed = executed_step(step, before);
  if (!executed) return false;
  std::vector<StepMemo::SentWay> ways;
  for (const kernel::MessageView& message : bag) {
    std::vector<SentBody> sent;
    decode_sent(message.payload, sent);
    for (const SentBody& body : sent) {
      const Ghost& ghost = body.ghost;
      if (executed->is_own(ghost.id) ||
          !is_out_of_reach(*executed, ghost, step_.work.worlds.absorption_looks))
        return false;
      ways.push_back({ghost.owner, ghost.box});
    }
  }
  buffer_.add_sent(step + 1, ways);
  return true;
}

// A late answer. What it changes of its own step changes what is extrapolated in later ones: all of
// them have to come out as they did.
bool StragglerAbsorption::absorb_with_extrapolation(std::int64_t from, Bag bag) {
  std::vector<std::pair<ReceivedGhosts, std::vector<Ghost>>> steps;
  std::vector<BodyId> changed;
  ForeignView before = buffer_.view(from);
  const std::int64_t after = next_.t + (next_ > time_of(next_.t, Phase::kBorderTraversal));
  for (std::int64_t step = from; step < after; ++step) {
    const Rules& rules = is_over(step) ? buffer_.rules(step + 1) : step_.rules;
    const ForeignView& was = is_over(step) ? buffer_.view(step + 1) : extrapolation_.view();
    ReceivedGhosts received = step > from ? received_only(was.received) : ghosts_in(bag);
    const bool same_speakers = news_from(before) == news_from(buffer_.view(step));
    const bool only_more = std::includes(received.from.begin(), received.from.end(),
                                         was.received.from.begin(), was.received.from.end());
    received = same_speakers && only_more
                   ? extrapolation_.completed_again(rules, before, changed, was.received,
                                                    std::move(received))
                   : extrapolation_.completed(rules, before, std::move(received));
    changed = differing(was.received.ghosts, received.ghosts);
    std::vector<Ghost> usable = foreign_ghosts(received.ghosts, own_bodies(step));
    if (!changed.empty() && !comes_out_alike(step, usable)) return false;
    before = was;
    before.received = received;
    steps.emplace_back(std::move(received), std::move(usable));
    if (changed.empty()) break;
  }
  for (auto& [now_received, usable] : steps)
    adopt(from++, std::move(now_received), std::move(usable));
  return true;
}

void StragglerAbsorption::adopt(std::int64_t step, ReceivedGhosts received,
                                std::vector<Ghost> usable) {
  extrapolation_.audit(step, buffer_.view(step), received);
  if (!is_over(step)) {
    extrapolation_.view().received = std::move(received);
    step_.ghosts = usable;
    step_.memo.ghosts = std::move(usable);
    return;
  }
  const std::int64_t end = step + 1;
  if (!differing(buffer_.view(end).received.ghosts, received.ghosts).empty()) {
    // A stale entry after it was computed from what is replaced here.
    buffer_.frame_differs(end) = true;
    buffer_.replace_ghosts(end, std::move(usable));
  }
  buffer_.replace_received(end, std::move(received));
}

// Whose bodies they are during a step that has begun. What it refers to are its own bodies now, or
// those of the entry that it has written.
std::function<bool(BodyId)> StragglerAbsorption::own_bodies(std::int64_t step) const {
  if (const StoredEntry* const end = is_over(step) ? buffer_.stored(step + 1) : nullptr)
    return [end](BodyId id) { return end->bodies.find(id) != nullptr; };
  const std::span<const BodyId> ids = is_over(step) ? buffer_.open(step + 1)->ids : step_.ids;
  return [ids](BodyId id) { return std::binary_search(ids.begin(), ids.end(), id); };
}

// Of a step whose pairs have been tested; none if its memo is gone. `ghosts` is memory for what it
// refers to.
std::optional<ExecutedStep> StragglerAbsorption::executed_step(std::int64_t step,
                                                               std::vector<Ghost>& ghosts) const {
  const StoredEntry* const start = buffer_.stored(step);
  const BufferEntry* const open = is_over(step) ? buffer_.open(step + 1) : nullptr;
  const StoredEntry* const end = is_over(step) ? buffer_.stored(step + 1) : nullptr;
  const StepMemo& memo = open != nullptr ? open->memo : step_.memo;
  if (start == nullptr || !(end != nullptr ? end->memo_valid : memo.valid)) return std::nullopt;
  const Rules& rules = is_over(step) ? buffer_.rules(step + 1) : step_.rules;
  ExecutedStep executed{.map = *rules.map,
                        .scene = *rules.scene,
                        .geometry = step_.around.geometry,
                        .self = step_.self,
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
bool StragglerAbsorption::comes_out_alike(std::int64_t step, std::span<const Ghost> usable) {
  if (step == next_.t && next_ <= time_of(step, Phase::kPairs)) return true;
  std::vector<Ghost> before;
  const std::optional<ExecutedStep> executed = executed_step(step, before);
  return executed && makes_no_difference(*executed, usable, step_.work.stages,
                                         step_.work.worlds.absorption_looks, refusal_);
}

}  // namespace soda::models
