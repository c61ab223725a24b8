#include "kernel/slot_table.hpp"

#include <utility>

#include "kernel/invariant.hpp"

namespace soda::kernel {

std::uint32_t SlotTable::take(const OutputId& id) {
  if (4 * (used_ + 1) > 3 * entries_.size()) make_room();
  const std::size_t mask = entries_.size() - 1;
  Entry* room = nullptr;
  std::size_t place = first_place(id);
  for (; entries_[place].count != kUnused; place = (place + 1) & mask) {
    Entry& entry = entries_[place];
    if (entry.holds(id)) return entry.count++;
    if (room == nullptr && is_void(entry)) room = &entry;
  }
  if (room == nullptr) {
    room = &entries_[place];
    ++used_;
  }
  filter_ |= filter_bit(id);
  *room = {id.time.t, id.time.round, id.destination, id.kind, 1};
  return 0;
}

std::uint32_t SlotTable::find_count(const OutputId& id) const {
  const std::size_t mask = entries_.size() - 1;
  for (std::size_t place = first_place(id);; place = (place + 1) & mask) {
    const Entry& entry = entries_[place];
    if (entry.count == kUnused) return 0;
    if (entry.holds(id)) return entry.count;
  }
}

void SlotTable::release(const OutputId& id) {
  std::size_t place = first_place(id);
  while (!entries_[place].holds(id)) {
    SODA_ASSERT(entries_[place].count != kUnused, "slot ", id.slot, " at ", id.time, " to LP ",
                index_of(id.destination), " was never taken");
    place = (place + 1) & (entries_.size() - 1);
  }
  Entry& entry = entries_[place];
  SODA_ASSERT(entry.count == id.slot + 1, "slot ", id.slot, " of ", entry.count, " at ", id.time,
              " to LP ", index_of(id.destination), " is given back");
  --entry.count;
}

void SlotTable::make_room() {
  std::vector<Entry> old = std::exchange(entries_, {});
  std::size_t valid = 0;
  const auto keep = [&](const Entry& entry) { return entry.count != kUnused && !is_void(entry); };
  for (const Entry& entry : old) valid += keep(entry);
  entries_.resize(std::bit_ceil(2 * valid + 4));
  used_ = valid;
  filter_ = 0;
  for (const Entry& entry : old) {
    if (!keep(entry)) continue;
    const OutputId id{entry.time(), entry.destination, entry.kind, 0};
    filter_ |= filter_bit(id);
    std::size_t place = first_place(id);
    while (entries_[place].count != kUnused) place = (place + 1) & (entries_.size() - 1);
    entries_[place] = entry;
  }
}

}  // namespace soda::kernel
