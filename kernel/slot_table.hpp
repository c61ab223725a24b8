// Which slots of which registers an LP has sent to.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernel/message.hpp"
#include "kernel/virtual_time.hpp"

namespace soda::kernel {

// For each (time, destination, kind), how many slots are in use. Slots are taken in the order of
// sending and given back in the reverse one, so the smallest free slot is the number in use. An
// open hash table; its order is never looked at.
class SlotTable {
 public:
  // The next free slot; id.slot is ignored. No id at or before the time last forgotten.
  std::uint32_t take(const OutputId& id);

  // How many slots are in use, which is the next free one.
  std::uint32_t count_of(const OutputId& id) const {
    return (filter_ & filter_bit(id)) == 0 ? 0 : find_count(id);
  }

  // Gives back the slot taken last.
  void release(const OutputId& id);

  // Nothing will be sent to `kept` or earlier any more: that may be dropped, and is as new entries
  // need the room.
  void forget(VirtualTime kept) { kept_ = kept; }

 private:
  static constexpr std::uint32_t kUnused = ~0u;

  struct Entry {
    VirtualTime time() const { return {t, round}; }
    bool holds(const OutputId& id) const {
      return t == id.time.t && round == id.time.round && destination == id.destination &&
             kind == id.kind && count != kUnused;
    }

    std::int64_t t = 0;
    std::uint32_t round = 0;
    LpId destination{};
    std::uint32_t kind = 0;
    std::uint32_t count = kUnused;  // 0: given back
  };

  static std::uint64_t hash(const OutputId& id) {
    const std::uint64_t word = static_cast<std::uint64_t>(id.time.t) ^
                               std::rotl(std::uint64_t{index_of(id.destination)}, 40) ^
                               std::rotl(std::uint64_t{id.kind}, 20) ^
                               std::rotl(std::uint64_t{id.time.round}, 56);
    return word * 0x9e3779b97f4a7c15ull;
  }
  static std::uint64_t filter_bit(const OutputId& id) {
    return std::uint64_t{1} << (hash(id) >> 58);
  }
  std::size_t first_place(const OutputId& id) const {
    return (hash(id) << 6) >> (64 - std::countr_zero(entries_.size()));
  }
  std::uint32_t find_count(const OutputId& id) const;
  bool is_void(const Entry& entry) const { return entry.count == 0 || entry.time() <= kept_; }
  void make_room();

  std::uint64_t filter_ =
      0;  // the bits of all entries: most of what is not there, it tells at once
  VirtualTime kept_ = kBeginning;
  std::vector<Entry> entries_;  // a power of two, never all in use
  std::size_t used_ = 0;        // void ones included
};

}  // namespace soda::kernel
