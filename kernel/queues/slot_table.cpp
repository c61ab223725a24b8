#include "kernel/queues/slot_table.hpp"

#include <algorithm>
#include <bit>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/invariant.hpp"

namespace soda::kernel {

// Where the id is, or would be.
std::size_t SlotTable::cell_of(const OutputId& id) const {
  const std::uint64_t place = std::uint64_t{index_of(id.destination)} << 32 | id.kind;
  const std::uint64_t time = static_cast<std::uint64_t>(id.time.t) ^ mix64(id.time.round);
  std::size_t at = mix64(time ^ mix64(place));
  for (const std::size_t mask = index_->size() - 1;; ++at) {
    const Cell& cell = (*index_)[at & mask];
    if (cell.taken == 0 || entries_[cell.first].has_id(id)) return at & mask;
  }
}

void SlotTable::note(const OutputId& id, std::size_t at) {
  Cell& cell = (*index_)[cell_of(id)];
  if (cell.taken++ == 0) cell.first = static_cast<std::uint32_t>(at);
}

std::uint32_t SlotTable::find_next(const OutputId& id) const {
  if (index_) return (*index_)[cell_of(id)].taken;
  for (const Entry* entry = entries_.end(); entry != entries_.begin();)
    if ((--entry)->has_id(id)) return entry->slot + 1;
  return 0;
}

// What is dropped was sent before anything that can be undone, so it never comes last here.
OutputId SlotTable::release(VirtualTime kept) {
  SODA_ASSERT(!entries_.empty() && entries_.back().time() > kept,
              "a slot is given back, not taken, of ", entries_.size(), " taken, all up to ", kept,
              " forgotten");
  const Entry last = entries_.back();
  const OutputId id{last.time(), last.destination, last.kind, last.slot};
  if (index_) --(*index_)[cell_of(id)].taken;
  entries_.truncate(entries_.size() - 1);
  ++room_;
  return id;
}

void SlotTable::take_again(const OutputId& id, VirtualTime kept) {
  SODA_ASSERT(find_next(id) == id.slot, "slot ", id.slot, " at ", id.time, " to LP ",
              index_of(id.destination), " is taken again, free is ", find_next(id));
  append(id, id.slot, Filter::bits_of(id.time.t, id.time.round, id.destination, id.kind), kept);
}

// Without a branch on what stays, which nobody can foresee.
void SlotTable::make_room(VirtualTime kept) {
  filter_ = {};
  Entry* end = entries_.begin();
  for (const Entry& entry : entries_) {
    const bool stays = entry.time() > kept;
    filter_.set_if(stays, Filter::bits_of(entry.t, entry.round, entry.destination, entry.kind));
    *end = entry;
    end += stays;
  }
  entries_.truncate(static_cast<std::size_t>(end - entries_.begin()));
  room_ = std::max(8u, static_cast<std::uint32_t>(entries_.size()));
  make_index();
}

// At most half full when there is room for no more.
void SlotTable::make_index() {
  index_.reset();
  if (entries_.size() < kMostUnindexed) return;
  index_ = std::make_unique<std::vector<Cell>>(4 * std::bit_ceil(entries_.size()));
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    note({entry.time(), entry.destination, entry.kind, 0}, i);
  }
}

}  // namespace soda::kernel
