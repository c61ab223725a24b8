#include "models/stored_entry.hpp"

#include <bit>
#include <cstddef>
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

std::vector<StoredBody> stored_bodies(SharedMemory& memory, const BufferEntry& entry,
                                      const StoredEntry& older, const StoredEntry& replaced) {
  std::vector<StoredBody> bodies(entry.ids.size());
  SharedList<StoredBody>::Cursor before(older.bodies), instead(replaced.bodies);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyId id = entry.ids[i];
    bodies[i].id = id;
    if (entry.memo.valid) bodies[i].island = entry.memo.islands[i];
    bodies[i].state =
        packed(memory, entry.states[i], before.advance_to(id), instead.advance_to(id));
  }
  return bodies;
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

void store_memo(SharedMemory& memory, const StepMemo& memo, const StoredEntry& older,
                const StoredEntry& replaced, StoredEntry& stored) {
  std::vector<StoredMigrant> migrants;
  for (const Migrant& migrant : memo.migrants)
    migrants.push_back({migrant.id, packed(memory, migrant.state, older.migrants.find(migrant.id),
                                           replaced.migrants.find(migrant.id))});
  stored.migrants = {memory, migrants, older.migrants};
  stored.ghosts = stored_ghosts(memory, memo.ghosts, older.ghosts, replaced.ghosts);
  stored.tested = {memory, memo.tested, older.tested};
  stored.border = {memory, memo.border, older.border};
}

SharedArray<Gate> stored_gate(SharedMemory& memory, const Gate& gate,
                              const SharedArray<Gate>& older, const SharedArray<Gate>& replaced) {
  for (const SharedArray<Gate>& before : {older, replaced})
    if (!before.items().empty() && before.items().front() == gate) return before;
  return {memory, {&gate, 1}};
}

bool is_empty(const ForeignView& view) {
  return view.told.empty() && view.sent_to.empty() && view.heard.from.empty() &&
         view.heard.ghosts.empty() && view.known.empty();
}

std::uint64_t whole_bytes(const std::vector<BodyState>& states) {
  std::uint64_t bytes = states.size() * sizeof(BodyState);
  for (const BodyState& state : states)
    bytes += state.impulses.size() * sizeof(physics::ContactImpulse);
  return bytes;
}

}  // namespace

bool ListItem<StoredBody>::same(const StoredBody& a, const StoredBody& b) {
  return a.id == b.id && a.island.label == b.island.label && a.island.bodies == b.island.bodies &&
         a.state == b.state;
}

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
         a.direct == b.direct && a.iterations == b.iterations &&
         a.multiplications == b.multiplications &&
         same_bits(a.max_penetration_m, b.max_penetration_m) &&
         same_bits(a.constraint_residual_m_s, b.constraint_residual_m_s) &&
         same_bits(a.static_impulse_newton_s, b.static_impulse_newton_s) &&
         same_bits(a.static_angular_impulse_newton_m_s, b.static_angular_impulse_newton_m_s);
}

bool ListItem<ContactManifold>::same(const ContactManifold& a, const ContactManifold& b) {
  if (a.a != b.a || a.b != b.b || a.part != b.part || a.count != b.count) return false;
  if (!same_bits(a.normal, b.normal)) return false;
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
  stored.rules = entry.rules;
  stored.differs = std::exchange(entry.differs, {});
  stored.bodies = {memory, stored_bodies(memory, entry, older, replaced), older.bodies};
  const std::uint64_t with_bodies = memory.taken_bytes;
  stored.islands = {memory, entry.islands, older.islands};
  if (entry.memo.valid) store_memo(memory, entry.memo, older, replaced, stored);
  ++counters.entries_stored;
  stored.gate = stored_gate(memory, entry.gate, older.gate, replaced.gate);
  if (!is_empty(entry.view))
    stored.view = std::make_unique<ForeignView>(std::exchange(entry.view, {}));
  stored.solves = entry.solves;
  stored.frame_differs = entry.frame_differs;
  stored.spent_ns = entry.spent_ns;
  if (entry.memo.valid) stored.touched = entry.memo.touched;
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
