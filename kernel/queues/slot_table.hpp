// Which slots of which message ids an LP has sent to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernel/api/message.hpp"
#include "kernel/api/virtual_time.hpp"
#include "kernel/queues/sliding_vector.hpp"

namespace soda::kernel {

// The message ids that an LP has sent to, in the order of sending, for as long as it may send to
// their times again. Slots of one (time, destination, kind) are numbered in that order and given
// back in the reverse one, so the next free one follows the latest. Most message ids have one slot:
// a filter of few bits tells that at once, and the list is looked through for the others. Of many
// entries an index is kept: a send costs the same however many there are.
class SlotTable {
 public:
  // Nothing will be sent to `kept` or earlier any more: entries of these times make room for
  // others. They are taken for as long, which can be long after the output itself is irrevocable.

  // Takes the next free slot; id.slot is ignored.
  std::uint32_t take(const OutputId& id, VirtualTime kept);

  // Gives back the slot taken last of all.
  OutputId release(VirtualTime kept);

  // Hints that a slot will be taken soon.
  [[gnu::always_inline]] void prefetch() const { __builtin_prefetch(entries_.end()); }

  // Takes id.slot, which is the next free one.
  void take_again(const OutputId& id, VirtualTime kept);

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
    bool has_id(const OutputId& id) const {
      return t == id.time.t && destination == id.destination && round == id.time.round &&
             kind == id.kind;
    }
  };

  // Two bits of one word for each message id, spread: of 40 message ids, one in 30 others seems
  // known.
  class Filter {
   public:
    struct Bits {
      std::size_t word;
      std::uint64_t mask;
    };
    static Bits bits_of(std::int64_t t, std::uint32_t round, LpId destination, std::uint32_t kind) {
      const std::uint64_t word = static_cast<std::uint64_t>(t) +
                                 (std::uint64_t{index_of(destination)} << 32) + (kind << 8) +
                                 (std::uint64_t{round} << 48);
      const std::uint64_t hash = word * 0x9e3779b97f4a7c15ull;
      const std::uint64_t one = 1;
      return {hash >> 61, one << (hash >> 55 & 63) | one << (hash >> 49 & 63)};
    }
    bool has(const Bits& bits) const { return (words_[bits.word] & bits.mask) == bits.mask; }
    void set(const Bits& bits) { words_[bits.word] |= bits.mask; }
    void set_if(bool is, const Bits& bits) { words_[bits.word] |= is ? bits.mask : 0; }

   private:
    std::uint64_t words_[8] = {};
  };

  // Of one message id: where its first entry lies, and how many slots of it are taken. Message ids
  // are given up in the reverse order of their first entries, so a cell can be emptied although
  // others were passed on to the next ones: these are empty already.
  struct Cell {
    std::uint32_t first = 0;
    std::uint32_t taken = 0;  // 0: empty
  };
  static constexpr std::size_t kMostUnindexed = 64;

  std::uint32_t find_next(const OutputId& id) const;
  void append(const OutputId& id, std::uint32_t slot, const Filter::Bits& bits, VirtualTime kept) {
    if (--room_ == 0) [[unlikely]]
      make_room(kept);
    filter_.set(bits);
    entries_.emplace_back(id.time.t, id.time.round, id.destination, id.kind, slot);
    if (index_) [[unlikely]]
      note(id, entries_.size() - 1);
  }
  std::size_t cell_of(const OutputId& id) const;
  void note(const OutputId& id, std::size_t at);
  void make_room(VirtualTime kept);
  void make_index();

  Filter filter_;  // of all entries, and of some that are gone
  SlidingVector<Entry> entries_;
  std::uint32_t room_ = 1;                    // so many more until it is time to drop void ones
  std::unique_ptr<std::vector<Cell>> index_;  // by a hash; a power of two of cells, or none
};

inline std::uint32_t SlotTable::take(const OutputId& id, VirtualTime kept) {
  const Filter::Bits bits = Filter::bits_of(id.time.t, id.time.round, id.destination, id.kind);
  const std::uint32_t slot = filter_.has(bits) ? find_next(id) : 0;
  append(id, slot, bits, kept);
  return slot;
}

}  // namespace soda::kernel
