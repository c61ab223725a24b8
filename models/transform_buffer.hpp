// The circular transform buffer of a world: one entry a step, its checkpoint store.
#pragma once

#include <cstdint>
#include <vector>

#include "models/gating.hpp"
#include "models/rules.hpp"
#include "models/step_memo.hpp"
#include "physics/advance.hpp"
#include "physics/body_state.hpp"

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
  Gate gate;                                   // of step - 1
  Rules rules;                                 // of step - 1; at step 0, of that
  // Modelled cost of step - 1, all its executions; only if loads are sampled.
  std::int64_t spent_ns = 0;
  // Bodies whose state here is not the one that the next entry, a stale one, was computed from.
  // Ascending.
  std::vector<physics::BodyId> differs;
  // The same of who is there, of the gate and of the rules.
  bool frame_differs = false;
};

// Entries of consecutive steps oldest .. newest, at most `capacity` of them. What a truncation
// drops stays as *stale* entries after the newest, until they are written again.
class TransformBuffer {
 public:
  // Holds `initial` as its only entry. `capacity` >= 2.
  TransformBuffer(std::size_t capacity, BufferEntry initial);

  std::int64_t oldest() const { return oldest_; }
  std::int64_t newest() const { return newest_; }
  bool holds(std::int64_t step) const { return oldest_ <= step && step <= newest_; }
  // `step` must be held.
  BufferEntry& at(std::int64_t step);
  const BufferEntry& newest_entry() const;
  // The stale entry newest() + 1, or null.
  BufferEntry* stale_next();
  bool has_stale() const { return newest_ < newest_stale_; }
  // The slot for entry newest() + 1. Aborts when the buffer is full. All fields but `step` hold
  // what was there before: the caller swaps its own vectors in, and so their memory circulates.
  BufferEntry& append();
  // Of the entries from newest() on that a truncation dropped, puts back in force those that were
  // computed from one another, up to `step` at most.
  void put_back(std::int64_t step);
  // Drops every entry after `step`, which must be held.
  void truncate(std::int64_t step);
  // Drops entries before `step`, but never the newest.
  void forget(std::int64_t step);

 private:
  BufferEntry& slot(std::int64_t step);

  std::vector<BufferEntry> ring_;
  std::int64_t oldest_, newest_;
  std::int64_t newest_stale_;  // entries newest_ + 1 .. newest_stale_ are stale
};

}  // namespace soda::models
