#include "kernel/slot_table.hpp"

#include <algorithm>

#include "kernel/invariant.hpp"

namespace soda::kernel {

std::uint32_t SlotTable::find_next(const OutputId& id) const {
  for (const Entry* entry = entries_.end(); entry != entries_.begin();)
    if ((--entry)->is_register(id)) return entry->slot + 1;
  return 0;
}

// What is void was sent before anything that can be undone, so it never comes last here.
OutputId SlotTable::release() {
  SODA_ASSERT(!entries_.empty() && !is_void(entries_.back()), "a slot is given back, not taken, ",
              "of ", entries_.size(), " taken, all up to ", kept_, " forgotten");
  const Entry last = entries_.back();
  entries_.truncate(entries_.size() - 1);
  ++room_;
  return {last.time(), last.destination, last.kind, last.slot};
}

void SlotTable::take_again(const OutputId& id) {
  SODA_ASSERT(find_next(id) == id.slot, "slot ", id.slot, " at ", id.time, " to LP ",
              index_of(id.destination), " is taken again, free is ", find_next(id));
  append(id, id.slot, Filter::place(id.time.t, id.time.round, id.destination, id.kind));
}

void SlotTable::make_room() {
  filter_ = {};
  Entry* kept = entries_.begin();
  for (const Entry& entry : entries_) {
    if (is_void(entry)) continue;
    filter_.set(Filter::place(entry.t, entry.round, entry.destination, entry.kind));
    *kept++ = entry;
  }
  entries_.truncate(static_cast<std::size_t>(kept - entries_.begin()));
  room_ = std::max(4u, static_cast<std::uint32_t>(entries_.size()));
}

}  // namespace soda::kernel
