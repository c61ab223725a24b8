// What the LPs of one worker have executed in order and no rollback has touched since.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "kernel/api/payload.hpp"
#include "kernel/api/virtual_time.hpp"
#include "kernel/queues/sliding_vector.hpp"

namespace soda::kernel {

class TimeWarpProcess;

// One entry an execution, in the order of execution: so those of one LP are in order, too, and are
// linked. GVT takes them out, all but always at the front, where they are still in the cache; a
// rollback moves those of its LP to the LP's own history first (TimeWarpProcess::take_back).
class Journal {
 public:
  struct Entry {
    TimeWarpProcess* lp;  // null: it has been taken out
    std::int64_t t;
    std::uint32_t round;
    std::uint32_t back;         // so many entries back is the one before of this LP; 0: none
    std::uint32_t first_input;  // in the pool, linked in canonical order
    std::uint32_t outputs;
    std::uint32_t output_at;  // number of the first one
    std::uint32_t state_at;   // number of the first byte of the state before it

    VirtualTime time() const { return {t, round}; }
  };
  static_assert(sizeof(Entry) == 40);

  // Numbers rise and are not used twice; those of outputs and of bytes do so modulo 2^32.
  std::uint64_t first_number() const { return first_; }
  std::uint64_t next_number() const { return next_; }
  bool has(std::uint64_t number) const { return number >= first_; }
  Entry& operator[](std::uint64_t number) { return entries_[number - first_]; }

  std::uint32_t next_output() const { return next_output_; }
  Payload& output(std::uint32_t number) { return outputs_[number - first_output_]; }

  void append_output(const Payload& payload) {
    outputs_.emplace_back(payload);
    ++next_output_;
  }
  std::uint32_t next_state() const { return next_state_; }
  const std::byte* state(std::uint32_t number) { return &states_[number - first_state_]; }

  void append_state(std::span<const std::byte> state) {
    states_.append(state.data(), state.size());
    next_state_ += static_cast<std::uint32_t>(state.size());
  }
  void append(const Entry& entry) {
    entries_.emplace_back(entry);
    ++next_;
  }

  std::uint64_t size() const { return next_ - first_; }

  // Gives back the room of what has been taken out.
  void drop_taken() {
    std::uint64_t taken = 0;
    while (taken < size() && entries_[taken].lp == nullptr) ++taken;
    if (taken > 0) drop_first(taken);
  }
  // The same for the first `count`, all of which have been.
  void drop_first(std::uint64_t count) {
    const bool some_stay = count < size();
    const std::uint32_t output = some_stay ? entries_[count].output_at : next_output_;
    const std::uint32_t state = some_stay ? entries_[count].state_at : next_state_;
    entries_.drop_front(count);
    first_ += count;
    outputs_.drop_front(output - first_output_);
    first_output_ = output;
    states_.drop_front(state - first_state_);
    first_state_ = state;
  }

 private:
  SlidingVector<Entry> entries_;
  SlidingVector<Payload> outputs_;   // as sent
  SlidingVector<std::byte> states_;  // of LPs whose state the executor saves
  std::uint64_t first_ = 1;          // number of entries_.front()
  std::uint64_t next_ = 1;           // and of the one that is appended next
  std::uint32_t first_output_ = 0;   // number of outputs_.front()
  std::uint32_t next_output_ = 0;
  std::uint32_t first_state_ = 0;  // number of states_.front()
  std::uint32_t next_state_ = 0;
};

}  // namespace soda::kernel
