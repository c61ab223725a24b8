#include "models/world/absorption.hpp"

#include <algorithm>

#include "models/world/event_kinds.hpp"

namespace soda::models {
namespace {

using physics::Aabb;
using physics::BodyId;
using physics::BodyState;

// As find_border_contacts() decides it, for owners that differ.
bool is_tester(const ExecutedStep& step, const Aabb& a, const Aabb& b) {
  return step.map.owner_at(a.min.cwiseMax(b.min)) == step.self;
}

bool touch(const ExecutedStep& step, BodyId a, const BodyState& state_a, BodyId b,
           const BodyState& state_b, physics::StageCounters& counters) {
  std::vector<physics::ContactManifold> found;
  if (a < b)
    physics::collide({step.scene, step.geometry, step.scene.dt_s, a, state_a, b, &state_b}, found,
                     counters);
  else
    physics::collide({step.scene, step.geometry, step.scene.dt_s, b, state_b, a, &state_a}, found,
                     counters);
  return !found.empty();
}

kernel::Refusal refusal(Refused why, BodyId subject, BodyId other = BodyId{~0u}) {
  return {static_cast<std::uint32_t>(why), physics::index_of(subject), physics::index_of(other)};
}

// With own bodies. A cell that is no border cell is not in the index, so nothing is known of it.
bool is_clear_of_own(const ExecutedStep& step, const Ghost& ghost, physics::StageCounters& counters,
                     std::uint64_t& looked_at, kernel::Refusal& why) {
  why = refusal(Refused::kInDoubt, ghost.id);
  std::vector<std::uint32_t> cells;
  if (!step.map.border_cells_of(ghost.box, step.self, cells)) return false;
  for (const std::uint32_t cell : cells) {
    for (const StepMemo::BorderBody& item : step.border_bodies(cell)) {
      ++looked_at;
      if (!overlap(item.box, ghost.box) || !is_tester(step, item.box, ghost.box)) continue;
      const std::optional<BodyState> state = step.begin_state(item.id);
      if (state && !touch(step, item.id, *state, ghost.id, ghost.state, counters)) continue;
      why = refusal(Refused::kTouches, ghost.id, item.id);
      return false;
    }
  }
  return true;
}

bool is_clear_of_ghosts(const ExecutedStep& step, const Ghost& ghost, std::span<const Ghost> ghosts,
                        physics::StageCounters& counters, std::uint64_t& looked_at,
                        kernel::Refusal& why) {
  for (const Ghost& other : ghosts) {
    ++looked_at;
    if (other.owner == ghost.owner || !overlap(other.box, ghost.box) ||
        !is_tester(step, other.box, ghost.box))
      continue;
    if (!touch(step, other.id, other.state, ghost.id, ghost.state, counters)) continue;
    why = refusal(Refused::kTouches, ghost.id, other.id);
    return false;
  }
  return true;
}

// To one of them that another world owns: of its own bodies that one knows itself.
bool comes_near(const auto& others, const Ghost& ghost) {
  return std::ranges::any_of(others, [&ghost](const auto& other) {
    return other.owner != ghost.owner && overlap(other.box, ghost.box);
  });
}

// The ghost that was there made a difference: it had a contact, or something sent on came near.
bool mattered(const ExecutedStep& step, const Ghost& ghost, std::uint64_t& looked_at,
              kernel::Refusal& why) {
  looked_at += step.contacts + step.sent.size();
  if (const std::optional<BodyId> other = step.contact_of(ghost.id)) {
    why = refusal(Refused::kTouched, ghost.id, *other);
    return true;
  }
  why = refusal(Refused::kMeetsSent, ghost.id);
  return comes_near(step.sent, ghost);
}

}  // namespace

void index_border(std::span<const BodyId> ids, std::span<const Aabb> boxes,
                  std::vector<std::uint64_t>& keys, std::vector<StepMemo::BorderBody>& index) {
  std::sort(keys.begin(), keys.end());
  index.clear();
  for (const std::uint64_t key : keys) {
    const auto own = static_cast<std::uint32_t>(key);
    index.push_back({static_cast<std::uint32_t>(key >> 32), ids[own], boxes[own]});
  }
}

bool makes_no_difference(const ExecutedStep& step, std::span<const Ghost> ghosts,
                         physics::StageCounters& counters, std::uint64_t& looked_at,
                         kernel::Refusal& why) {
  auto before = step.ghosts.begin();
  const auto end = step.ghosts.end();
  for (const Ghost& ghost : ghosts) {
    for (; before != end && before->id < ghost.id; ++before)
      if (mattered(step, *before, looked_at, why)) return false;
    if (before != end && before->id == ghost.id) {
      const Ghost& old = *before++;
      if (identical(old, ghost)) continue;
      if (mattered(step, old, looked_at, why)) return false;
    }
    why = refusal(Refused::kIsOwn, ghost.id);
    if (step.is_own(ghost.id)) return false;
    why = refusal(Refused::kMeetsSent, ghost.id);
    if (comes_near(step.sent, ghost)) return false;
    if (!is_clear_of_own(step, ghost, counters, looked_at, why) ||
        !is_clear_of_ghosts(step, ghost, ghosts, counters, looked_at, why))
      return false;
  }
  for (; before != end; ++before)
    if (mattered(step, *before, looked_at, why)) return false;
  return true;
}

bool is_out_of_reach(const ExecutedStep& step, const Ghost& sent, std::uint64_t& looked_at) {
  if (step.connects) return false;
  std::vector<std::uint32_t> cells;
  if (!step.map.border_cells_of(sent.box, step.self, cells)) return false;
  for (const std::uint32_t cell : cells)
    for (const StepMemo::BorderBody& item : step.border_bodies(cell)) {
      ++looked_at;
      if (overlap(item.box, sent.box)) return false;
    }
  looked_at += step.ghosts.size() + step.sent.size();
  return !comes_near(step.ghosts, sent) && !comes_near(step.sent, sent);
}

}  // namespace soda::models
