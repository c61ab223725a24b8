// The circular transform buffer of a world: one entry a step, its checkpoint store.
#pragma once

#include <cstdint>
#include <vector>

#include "models/transform_buffer/stored_entry.hpp"

namespace soda::models {

// Entries of consecutive steps oldest .. newest, at most `capacity` of them. What a truncation
// drops stays as *stale* entries after the newest, until they are written again.
//
// The newest entry is *open*, as it was written, until it is stored: when it is told to be, when a
// step takes its bodies, or when it becomes stale. Stored, it shares with the entry before it, and
// with the stale one that it takes the place of, what is bit-equal in them.
class TransformBuffer {
 public:
  // Holds `initial` as its only entry. `capacity` >= 2.
  TransformBuffer(std::size_t capacity, BufferEntry initial);
  TransformBuffer(const TransformBuffer&) = delete;  // entries know memory_
  TransformBuffer& operator=(const TransformBuffer&) = delete;

  std::int64_t oldest() const { return oldest_; }
  std::int64_t newest() const { return newest_; }
  bool holds(std::int64_t step) const { return oldest_ <= step && step <= newest_; }

  // In all below but forget(), `step` must be held.

  const Rules& rules(std::int64_t step) const;
  const Dependencies& dependencies(std::int64_t step) const;
  const ForeignView& view(std::int64_t step) const;
  bool may_leave(std::int64_t step) const;
  std::vector<physics::BodyId>& differs(std::int64_t step);
  bool& frame_differs(std::int64_t step);
  // Overwrites `ids` and `states` with the bodies of the newest entry, which must be open; its own
  // are void then. For a world that never goes back.
  void take_bodies(std::vector<physics::BodyId>& ids, std::vector<physics::BodyState>& states);
  // Stores the newest entry, if it is open. What that takes is added to `counters`. The bodies as
  // they were written are kept for copy_bodies().
  void store_open(WorldCounters& counters);
  // Overwrites them with those of entry `step`, which is stored if it is open; counted, too.
  void copy_bodies(std::int64_t step, std::vector<physics::BodyId>& ids,
                   std::vector<physics::BodyState>& states, WorldCounters& counters);
  // The entry, if it is open, or if it is stored; else null.
  const BufferEntry* open(std::int64_t step) const;
  const StoredEntry* stored(std::int64_t step) const;
  // In the memo of the entry.
  void replace_ghosts(std::int64_t step, std::vector<Ghost> ghosts);
  void add_sent(std::int64_t step, std::span<const StepMemo::SentWay> ways);
  // In the view of the entry.
  void replace_received(std::int64_t step, ReceivedGhosts received);
  // The entry: itself if it is open, else a copy in `copy`. Without memo; without bodies unless
  // `with_states`.
  const BufferEntry& read(std::int64_t step, bool with_states, BufferEntry& copy) const;

  // The newest entry, as by read(); the buffer is void then.
  BufferEntry release_newest();
  // The stale entry newest() + 1, or null.
  const StoredEntry* stale_next() const;
  bool has_stale() const { return newest_ < newest_stale_; }
  // Entry newest() + 1, to be written now. Aborts when the buffer is full. All fields but `step`
  // hold anything: the caller swaps its own vectors in, and so their memory circulates.
  BufferEntry& append();
  // Whether the stale entry after the newest was computed from one like it.
  bool newest_is_as_before() const {
    return is_open(newest_) ? open_.differs.empty() && !open_.frame_differs
                            : slot(newest_).differs.empty() && !slot(newest_).frame_differs;
  }
  // Of the entries from newest() on that a truncation dropped, puts back in force those that were
  // computed from one another, up to `step` at most. Storing is counted as by copy_bodies().
  void put_back(std::int64_t step, WorldCounters& counters);
  // Drops every entry after `step`. What storing the newest takes is added to `counters`.
  void truncate(std::int64_t step, WorldCounters& counters);
  // Drops entries before `step`, but never the newest.
  void forget(std::int64_t step);

  // Of all that is stored, and of what is to be.
  SharedMemory& memory() { return memory_; }
  const SharedMemory& memory() const { return memory_; }

 private:
  StoredEntry& slot(std::int64_t step);
  const StoredEntry& slot(std::int64_t step) const;
  bool is_open(std::int64_t step) const { return open_held_ && step == newest_; }
  void require_held(std::int64_t step) const;
  void newest_is(std::int64_t step);

  SharedMemory memory_;  // before what takes from it
  std::vector<StoredEntry> ring_;
  BufferEntry open_;  // entry newest_ if open_held_
  bool open_held_ = true;
  bool bodies_held_ = true;  // open_ has the bodies of entry newest_, be it stored or not
  std::int64_t oldest_, newest_;
  std::int64_t newest_stale_;  // entries newest_ + 1 .. newest_stale_ are stale
};

}  // namespace soda::models
