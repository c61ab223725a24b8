#include "models/transform_buffer/stored_entry.hpp"

#include <bit>
#include <cstddef>
#include <functional>
#include <utility>

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::ContactManifold;
using physics::ContactPoint;
using physics::IslandReport;

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same_bits(const physics::Vec3& a, const physics::Vec3& b) {
  return same_bits(a[0], b[0]) && same_bits(a[1], b[1]) && same_bits(a[2], b[2]);
}

bool same_bits(const ContactPoint& a, const ContactPoint& b) {
  return same_bits(a.position_m, b.position_m) && same_bits(a.separation_m, b.separation_m) &&
         a.feature == b.feature;
}

// The block of either item that has the bits of `state`, or a new one.
template <class T>
PackedState packed(SharedMemory& memory, const BodyState& state, const T* older,
                   const T* replaced) {
  if (older != nullptr && older->state.holds(state)) return older->state;
  if (replaced != nullptr && replaced->state.holds(state)) return replaced->state;
  return {memory, state};
}

// The block of the body's own in either item, if it has the bits of `state`. A body of which the
// older entry has none, but which has not moved since, gets one now: others of its chunk have.
PackedState resting(SharedMemory& memory, const BodyState& state, const StoredBody* older,
                    const StoredBody* replaced) {
  if (older != nullptr && older->state.holds(state))
    return older->state.own_block() ? *older->state.own_block() : PackedState(memory, state);
  if (replaced != nullptr && replaced->state.own_block() && replaced->state.holds(state))
    return *replaced->state.own_block();
  return {};
}

// Chunks of bodies, made from those of an entry.
class BodyChunks {
 public:
  BodyChunks(SharedMemory& memory, const BufferEntry& entry, const StoredEntry& older,
             const StoredEntry& replaced)
      : memory_(memory), entry_(entry), older_(older.bodies), replaced_(replaced.bodies) {}

  StepMemo::Membership island(std::size_t i) const {
    return entry_.memo.valid ? entry_.memo.islands[i] : StepMemo::Membership{};
  }
  std::size_t size() const { return entry_.ids.size(); }
  BodyId key_at(std::size_t i) const { return entry_.ids[i]; }
  bool is_at(const StoredBody& body, std::size_t i) const {
    const StepMemo::Membership now = island(i);
    return body.id == entry_.ids[i] && body.island.label == now.label &&
           body.island.bodies == now.bodies && body.state.holds(entry_.states[i]);
  }
  SharedArray<StoredBody> make(std::size_t first, std::size_t last) {
    resting_.clear();
    std::size_t words = 0;
    for (std::size_t i = first; i < last; ++i) {
      const BodyState& state = entry_.states[i];
      resting_.push_back(resting(memory_, state, older_.advance_to(entry_.ids[i]),
                                 replaced_.advance_to(entry_.ids[i])));
      if (resting_.back() == PackedState()) words += packed_words(state);
    }
    const auto fill = [&](StoredBody* item, std::byte* room) {
      auto* place = reinterpret_cast<std::uint64_t*>(room);
      for (std::size_t i = first; i < last; ++i, ++item) {
        const BodyState& state = entry_.states[i];
        PackedState& block = resting_[i - first];
        if (block == PackedState()) {
          ::new (item) StoredBody{entry_.ids[i], island(i), StateInChunk(state, place)};
          place += packed_words(state);
        } else {
          ::new (item) StoredBody{entry_.ids[i], island(i), StateInChunk(state, std::move(block))};
        }
      }
    };
    return {memory_, last - first, words * sizeof(std::uint64_t), fill};
  }

 private:
  SharedMemory& memory_;
  const BufferEntry& entry_;
  SharedList<StoredBody>::Cursor older_, replaced_;
  std::vector<PackedState> resting_;  // of the chunk, by place; empty: it moves
};

SharedList<StoredBody> stored_bodies(SharedMemory& memory, const BufferEntry& entry,
                                     const StoredEntry& older, const StoredEntry& replaced) {
  return {memory, BodyChunks(memory, entry, older, replaced), older.bodies, replaced.bodies};
}

SharedList<StoredGhost> stored_ghosts(SharedMemory& memory, std::span<const Ghost> ghosts,
                                      const SharedList<StoredGhost>& older,
                                      const SharedList<StoredGhost>& replaced) {
  std::vector<StoredGhost> items;
  for (const Ghost& ghost : ghosts)
    items.push_back({ghost.id, ghost.owner, ghost.box,
                     packed(memory, ghost.state, older.find(ghost.id), replaced.find(ghost.id))});
  return {memory, items, older};
}

void store_memo(SharedMemory& memory, StepMemo& memo, const StoredEntry& older,
                const StoredEntry& replaced, StoredEntry& stored) {
  std::vector<StoredMigrant> migrants;
  for (const Migrant& migrant : memo.migrants)
    migrants.push_back({migrant.id, packed(memory, migrant.state, older.migrants.find(migrant.id),
                                           replaced.migrants.find(migrant.id))});
  stored.migrants = {memory, migrants, older.migrants};
  stored.ghosts = stored_ghosts(memory, memo.ghosts, older.ghosts, replaced.ghosts);
  stored.tested = std::move(memo.tested);
  stored.border = {memory, memo.border, older.border};
}

// The array of either that holds one like `item`, or a new one.
template <class T, class Same>
SharedArray<T> stored_one(SharedMemory& memory, const T& item, const SharedArray<T>& older,
                          const SharedArray<T>& replaced, Same same) {
  for (const SharedArray<T>* before : {&older, &replaced})
    if (!before->items().empty() && same(before->items().front(), item)) return *before;
  return {memory, {&item, 1}};
}

// The same objects, not only equal ones: that is cheap, and nearly always so.
bool same_objects(const Rules& a, const Rules& b) {
  return a.map == b.map && a.scene == b.scene && a.inputs == b.inputs;
}

bool is_empty(const ForeignView& view) {
  return view.ghosts_sent_to.empty() && view.bodies_sent_to.empty() && view.received.from.empty() &&
         view.received.ghosts.empty() && view.known.empty();
}

std::uint64_t whole_bytes(const std::vector<BodyState>& states) {
  std::uint64_t bytes = states.size() * sizeof(BodyState);
  for (const BodyState& state : states)
    bytes += state.impulses.size() * sizeof(physics::ContactImpulse) +
             state.broken_joints.size() * sizeof(std::uint32_t);
  return bytes;
}

}  // namespace

bool ListItem<StoredMigrant>::same(const StoredMigrant& a, const StoredMigrant& b) {
  return a.id == b.id && a.state == b.state;
}

bool ListItem<StoredGhost>::same(const StoredGhost& a, const StoredGhost& b) {
  return a.id == b.id && a.owner == b.owner && same_bits(a.box.min, b.box.min) &&
         same_bits(a.box.max, b.box.max) && a.state == b.state;
}

bool ListItem<StepMemo::BorderBody>::same(const StepMemo::BorderBody& a,
                                          const StepMemo::BorderBody& b) {
  return a.cell == b.cell && a.id == b.id && same_bits(a.box.min, b.box.min) &&
         same_bits(a.box.max, b.box.max);
}

bool ListItem<IslandReport>::same(const IslandReport& a, const IslandReport& b) {
  return a.label == b.label && a.bodies == b.bodies && a.contact_points == b.contact_points &&
         a.direct == b.direct && a.rests == b.rests && a.iterations == b.iterations &&
         a.multiplications == b.multiplications &&
         same_bits(a.max_penetration_m, b.max_penetration_m) &&
         same_bits(a.constraint_residual_m_s, b.constraint_residual_m_s) &&
         same_bits(a.joint_error, b.joint_error) &&
         same_bits(a.push_out_work_joule, b.push_out_work_joule) &&
         same_bits(a.error_estimate, b.error_estimate) && a.worst_body == b.worst_body &&
         a.beyond_tolerance == b.beyond_tolerance &&
         same_bits(a.motor_work_joule, b.motor_work_joule) &&
         same_bits(a.static_impulse_newton_s, b.static_impulse_newton_s) &&
         same_bits(a.static_angular_impulse_newton_m_s, b.static_angular_impulse_newton_m_s);
}

bool ListItem<ContactManifold>::same(const ContactManifold& a, const ContactManifold& b) {
  if (a.a != b.a || a.b != b.b || a.part != b.part || a.count != b.count) return false;
  if (!same_bits(a.normal, b.normal) || !same_bits(a.impact_s, b.impact_s)) return false;
  for (std::uint32_t i = 0; i < a.count; ++i)
    if (!same_bits(a.points[i], b.points[i])) return false;
  return true;
}

StoredEntry store(SharedMemory& memory, BufferEntry& entry, const StoredEntry& older,
                  const StoredEntry& replaced, WorldCounters& counters) {
  const std::uint64_t before = memory.taken_bytes;
  StoredEntry stored;
  stored.step = entry.step;
  stored.memo_valid = entry.memo.valid;
  stored.memo_connects = entry.memo.connects;
  stored.differs = std::exchange(entry.differs, {});
  stored.bodies = stored_bodies(memory, entry, older, replaced);
  stored.rules = stored_one(memory, entry.rules, older.rules, replaced.rules, same_objects);
  const std::uint64_t with_bodies = memory.taken_bytes;
  stored.islands = {memory, entry.islands, older.islands};
  if (entry.memo.valid) store_memo(memory, entry.memo, older, replaced, stored);
  ++counters.entries_stored;
  stored.dependencies = stored_one(memory, entry.dependencies, older.dependencies,
                                   replaced.dependencies, std::equal_to());
  if (!is_empty(entry.view))
    stored.view = std::make_unique<ForeignView>(std::exchange(entry.view, {}));
  stored.solves = entry.solves;
  stored.frame_differs = entry.frame_differs;
  stored.may_leave = entry.may_leave;
  stored.spent_ns = entry.spent_ns;
  if (entry.memo.valid) stored.touched = entry.memo.touched;
  if (entry.memo.valid) stored.sent = entry.memo.sent;
  counters.bodies_stored += entry.ids.size();
  counters.state_bytes_whole += whole_bytes(entry.states);
  counters.state_bytes_stored += sizeof stored + with_bodies - before;
  counters.memo_bytes_stored += memory.taken_bytes - with_bodies;
  return stored;
}

void replace_ghosts(SharedMemory& memory, StoredEntry& entry, std::span<const Ghost> ghosts) {
  entry.ghosts = stored_ghosts(memory, ghosts, entry.ghosts, {});
}

std::vector<Ghost> load_ghosts(const StoredEntry& entry) {
  std::vector<Ghost> ghosts;
  entry.ghosts.for_each([&ghosts](const StoredGhost& stored) {
    ghosts.push_back({stored.id, stored.owner, stored.box, {}});
    stored.state.unpack(ghosts.back().state);
  });
  return ghosts;
}

const ForeignView& view_of(const StoredEntry& entry) {
  static const ForeignView kEmpty;
  return entry.view != nullptr ? *entry.view : kEmpty;
}

bool has_ids(const StoredEntry& entry, std::span<const BodyId> ids) {
  if (entry.bodies.size() != ids.size()) return false;
  auto id = ids.begin();
  bool equal = true;
  entry.bodies.for_each([&](const StoredBody& body) { equal = equal && body.id == *id++; });
  return equal;
}

void load_bodies(const StoredEntry& entry, std::vector<BodyId>& ids,
                 std::vector<BodyState>& states) {
  ids.clear();
  states.resize(entry.bodies.size());
  entry.bodies.for_each([&](const StoredBody& body) {
    body.state.unpack(states[ids.size()]);
    ids.push_back(body.id);
  });
}

}  // namespace soda::models
