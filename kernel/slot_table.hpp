// Which slots of which registers an LP has sent to.
#pragma once

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
  std::uint32_t count_of(const OutputId& id) const;

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

  std::size_t first_place(const OutputId& id) const;
  bool is_void(const Entry& entry) const { return entry.count == 0 || entry.time() <= kept_; }
  void make_room();

  VirtualTime kept_ = kBeginning;
  std::vector<Entry> entries_;  // a power of two, never all in use
  std::size_t used_ = 0;        // void ones included
};

}  // namespace soda::kernel
