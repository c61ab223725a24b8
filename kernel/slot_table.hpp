// Which slots of which registers an LP has sent to.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernel/message.hpp"
#include "kernel/sliding_vector.hpp"
#include "kernel/virtual_time.hpp"

namespace soda::kernel {

// The registers that an LP has sent to, in the order of sending, for as long as it may send to
// their times again. Slots of one (time, destination, kind) are numbered in that order and given
// back in the reverse one, so the next free one follows the latest. Most registers have one slot:
// a filter of few bits tells that at once, and the list is looked through for the others.
class SlotTable {
 public:
  // Takes the next free slot; id.slot is ignored. No id at or before the time last forgotten.
  std::uint32_t take(const OutputId& id);

  // Gives back the slot taken last of all.
  OutputId release();

  // Takes id.slot, which is the next free one.
  void take_again(const OutputId& id);

  // Nothing will be sent to `kept` or earlier any more: that may be dropped, and is as new entries
  // need the room.
  void forget(VirtualTime kept) { kept_ = kept; }

 private:
  struct Entry {
    std::int64_t t = 0;
    std::uint32_t round = 0;
    LpId destination{};
    std::uint32_t kind = 0;
    std::uint32_t slot = 0;

    Entry(std::int64_t t_, std::uint32_t round_, LpId destination_, std::uint32_t kind_,
          std::uint32_t slot_)
        : t(t_), round(round_), destination(destination_), kind(kind_), slot(slot_) {}

    VirtualTime time() const { return {t, round}; }
    bool is_register(const OutputId& id) const {
      return t == id.time.t && destination == id.destination && round == id.time.round &&
             kind == id.kind;
    }
  };

  // Bits of the filter: one for each register, of few that are spread.
  class Filter {
   public:
    static std::uint64_t place(std::int64_t t, std::uint32_t round, LpId destination,
                               std::uint32_t kind) {
      const std::uint64_t word = static_cast<std::uint64_t>(t) +
                                 (std::uint64_t{index_of(destination)} << 32) + (kind << 8) +
                                 (std::uint64_t{round} << 48);
      return word * 0x9e3779b97f4a7c15ull >> 56;
    }
    bool has(std::uint64_t place) const { return (words_[place / 64] >> (place % 64) & 1) != 0; }
    void set(std::uint64_t place) { words_[place / 64] |= std::uint64_t{1} << (place % 64); }

   private:
    std::uint64_t words_[4] = {};
  };
  std::uint32_t find_next(const OutputId& id) const;
  void append(const OutputId& id, std::uint32_t slot, std::uint64_t place) {
    if (--room_ == 0) [[unlikely]]
      make_room();
    filter_.set(place);
    entries_.emplace_back(id.time.t, id.time.round, id.destination, id.kind, slot);
  }
  bool is_void(const Entry& entry) const { return entry.time() <= kept_; }
  void make_room();

  Filter filter_;  // of all entries, and of some that are gone
  VirtualTime kept_ = kBeginning;
  SlidingVector<Entry> entries_;
  std::uint32_t room_ = 1;  // so many more until it is time to drop void ones
};

inline std::uint32_t SlotTable::take(const OutputId& id) {
  const std::uint64_t place = Filter::place(id.time.t, id.time.round, id.destination, id.kind);
  const std::uint32_t slot = filter_.has(place) ? find_next(id) : 0;
  append(id, slot, place);
  return slot;
}

}  // namespace soda::kernel
