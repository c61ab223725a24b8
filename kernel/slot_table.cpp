#include "kernel/slot_table.hpp"

#include <algorithm>

#include "kernel/invariant.hpp"

namespace soda::kernel {

std::uint32_t SlotTable::find_next(const OutputId& id) const {
  for (const Entry* entry = entries_.end(); entry != entries_.begin();)
    if ((--entry)->is_register(id)) return entry->slot + 1;
  return 0;
}

// What is dropped was sent before anything that can be undone, so it never comes last here.
OutputId SlotTable::release(VirtualTime kept) {
  SODA_ASSERT(!entries_.empty() && entries_.back().time() > kept,
              "a slot is given back, not taken, of ", entries_.size(), " taken, all up to ", kept,
              " forgotten");
  const Entry last = entries_.back();
  entries_.truncate(entries_.size() - 1);
  ++room_;
  return {last.time(), last.destination, last.kind, last.slot};
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
}

}  // namespace soda::kernel
