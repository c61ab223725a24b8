// Entries of a transform buffer: as a step reads and writes them, and as the buffer keeps them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "models/ghosts/extrapolated_ghosts.hpp"
#include "models/islands/dependencies.hpp"
#include "models/options/world_counters.hpp"
#include "models/transform_buffer/packed_state.hpp"
#include "models/transform_buffer/shared_list.hpp"
#include "models/transform_buffer/step_memo.hpp"
#include "models/user_input/rules.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"

namespace soda::models {

// What a world has at the start of step `step`: the bodies that it advanced in step - 1, those
// about to leave included.
struct BufferEntry {
  std::int64_t step = -1;            // -1: empty
  std::vector<physics::BodyId> ids;  // ascending
  std::vector<physics::BodyState> states;
  std::vector<physics::IslandReport> islands;  // solved in step - 1, whose label is an own body
  std::uint32_t solves = 0;                    // in step - 1: islands with an own body
  StepMemo memo;                               // of step - 1
  Dependencies dependencies;                   // of step - 1
  ForeignView view;                            // of step - 1
  Rules rules;                                 // of step - 1; of the first one, its own
  // Modelled cost of step - 1, all its executions; only if loads are sampled.
  std::int64_t spent_ns = 0;
  // Bodies whose state here is not the one that the next entry, a stale one, was computed from.
  // Ascending.
  std::vector<physics::BodyId> differs;
  // The same of who is there, of the gate, of the view and of the rules.
  bool frame_differs = false;
  // False: step - 1 ended with the centres of all bodies in the territory that it had.
  bool may_leave = true;
};

struct StoredBody {
  physics::BodyId id{};
  StepMemo::Membership island;  // 0 bodies if there is no memo
  StateInChunk state;
};
struct StoredMigrant {
  physics::BodyId id{};
  PackedState state;
};
struct StoredGhost {
  physics::BodyId id{};
  WorldId owner{};
  physics::Aabb box;
  PackedState state;
};

template <>
struct ListItem<StoredBody> {
  static physics::BodyId key(const StoredBody& body) { return body.id; }
};
template <>
struct ListItem<StoredMigrant> {
  static physics::BodyId key(const StoredMigrant& migrant) { return migrant.id; }
  static bool same(const StoredMigrant& a, const StoredMigrant& b);
};
template <>
struct ListItem<StoredGhost> {
  static physics::BodyId key(const StoredGhost& ghost) { return ghost.id; }
  static bool same(const StoredGhost& a, const StoredGhost& b);
};
template <>
struct ListItem<StepMemo::BorderBody> {
  static std::uint32_t key(const StepMemo::BorderBody& body) { return body.cell; }
  static bool same(const StepMemo::BorderBody& a, const StepMemo::BorderBody& b);
};
template <>
struct ListItem<physics::IslandReport> {
  static physics::BodyId key(const physics::IslandReport& report) { return report.label; }
  static bool same(const physics::IslandReport& a, const physics::IslandReport& b);
};
// The same as a BufferEntry, sharing with an older one what is bit-equal in it.
struct StoredEntry {
  std::int64_t step = -1;
  SharedList<StoredBody> bodies;
  SharedList<physics::IslandReport> islands;
  SharedList<StoredMigrant> migrants;
  SharedList<StoredGhost> ghosts;
  SharedList<physics::ContactManifold> tested;
  SharedList<StepMemo::BorderBody> border;
  SharedArray<Dependencies> dependencies;  // one
  SharedArray<Rules> rules;                // one
  std::unique_ptr<ForeignView> view;       // null: empty
  std::int64_t spent_ns = 0;
  std::vector<physics::BodyId> touched;  // of the memo
  std::vector<StepMemo::SentWay> sent;   // the same
  std::vector<physics::BodyId> differs;
  std::uint32_t solves = 0;
  bool memo_valid = false;  // false: nothing of the memo
  bool memo_connects = false;
  bool frame_differs = false;
  bool may_leave = true;
};

// Stores `entry`, whose differs, view and tested contacts are moved. `older`, the entry before, and
// `replaced`, an older version of the same entry, are where equal parts may be; either may be empty
// or not valid any more. What it takes is added to `counters`.
StoredEntry store(SharedMemory& memory, BufferEntry& entry, const StoredEntry& older,
                  const StoredEntry& replaced, WorldCounters& counters);

// The ghosts of the memo, and others in their place.
std::vector<Ghost> load_ghosts(const StoredEntry& entry);
void replace_ghosts(SharedMemory& memory, StoredEntry& entry, std::span<const Ghost> ghosts);

inline const Rules& rules_of(const StoredEntry& entry) { return entry.rules.items().front(); }

// What it knows of foreign bodies.
const ForeignView& view_of(const StoredEntry& entry);

// Whether its bodies are these.
bool has_ids(const StoredEntry& entry, std::span<const physics::BodyId> ids);

// Overwrites `ids` and `states` with the bodies of the entry.
void load_bodies(const StoredEntry& entry, std::vector<physics::BodyId>& ids,
                 std::vector<physics::BodyState>& states);

}  // namespace soda::models
