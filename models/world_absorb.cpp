// Late ghosts that touch nothing: what a world has executed stands.
#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "models/absorption.hpp"
#include "models/world.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using BorderBody = StepMemo::BorderBody;

std::optional<BodyState> unpacked(const PackedState& state) {
  std::optional<BodyState> result(std::in_place);
  state.unpack(*result);
  return result;
}

// Of a step whose memo is open. `start`, the entry that it began from, is stored: its bodies were
// copied out.
void look_into(const StepMemo& memo, std::span<const BodyId> ids, const StoredEntry& start,
               ExecutedStep& step) {
  step.ghosts = memo.ghosts;
  step.is_own = [ids](BodyId id) { return std::binary_search(ids.begin(), ids.end(), id); };
  step.begin_state = [&memo, &start](BodyId id) -> std::optional<BodyState> {
    if (std::ranges::binary_search(memo.touched, id)) return std::nullopt;
    const auto migrant = std::ranges::lower_bound(memo.migrants, id, {}, &Migrant::id);
    if (migrant != memo.migrants.end() && migrant->id == id) return migrant->state;
    const StoredBody* const body = start.bodies.find(id);
    return body == nullptr ? std::nullopt : unpacked(body->state);
  };
  step.border_bodies = [&memo](std::uint32_t cell) -> std::span<const BorderBody> {
    const auto found = std::ranges::equal_range(memo.border, cell, {}, &BorderBody::cell);
    return {found.begin(), found.end()};
  };
}

// Of a step that wrote `end`; `ghosts` are its, and must last.
void look_into(const StoredEntry& end, std::span<const Ghost> ghosts, const StoredEntry& start,
               ExecutedStep& step) {
  step.ghosts = ghosts;
  step.is_own = [&end](BodyId id) { return end.bodies.find(id) != nullptr; };
  step.begin_state = [&end, &start](BodyId id) -> std::optional<BodyState> {
    if (std::ranges::binary_search(end.touched, id)) return std::nullopt;
    if (const StoredMigrant* const migrant = end.migrants.find(id)) return unpacked(migrant->state);
    const StoredBody* const body = start.bodies.find(id);
    return body == nullptr ? std::nullopt : unpacked(body->state);
  };
  step.border_bodies = [&end](std::uint32_t cell) { return end.border.range(cell); };
}

}  // namespace

// Late ghosts of a step whose pairs have been tested.
bool World::absorb(kernel::VirtualTime now, Bag bag) {
  if (phase_of(now) != Phase::kBorderTraversal || bag.empty()) return false;
  const bool is_over = next_.t > now.t;
  if (!is_over && phase_of(next_) <= Phase::kPairs) return false;
  const StoredEntry* const start = buffer_.stored(now.t);
  const BufferEntry* const open = is_over ? buffer_.open(now.t + 1) : nullptr;
  const StoredEntry* const end = is_over ? buffer_.stored(now.t + 1) : nullptr;
  const StepMemo& memo = open != nullptr ? open->memo : memo_;
  if (start == nullptr || !(end != nullptr ? end->memo_valid : memo.valid)) return false;
  const Rules rules = is_over ? buffer_.rules(now.t + 1) : rules_;
  const std::vector<Ghost> before = end != nullptr ? load_ghosts(*end) : std::vector<Ghost>();
  ExecutedStep step{*rules.map, *rules.scene, around_.geometry, id_, {}, {}, {}, {}};
  if (end != nullptr)
    look_into(*end, before, *start, step);
  else
    look_into(memo, open != nullptr ? open->ids : ids_, *start, step);
  std::vector<Ghost> ghosts = foreign_ghosts(bag, step.is_own);
  if (!makes_no_difference(step, ghosts, stages_, counters_.absorption_looks)) return false;
  ++counters_.bags_absorbed;
  if (!is_over) ghosts_ = ghosts;
  if (is_over)
    buffer_.replace_ghosts(now.t + 1, std::move(ghosts));
  else
    memo_.ghosts = std::move(ghosts);
  return true;
}

}  // namespace soda::models
