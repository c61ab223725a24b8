// A body's state as immutable words: in a block that entries share, or beside others in a chunk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "models/transform_buffer/shared_array.hpp"
#include "physics/model/body_state.hpp"

namespace soda::models {

// Bits of every named field, without padding: 104 bytes and 48 a contact impulse, and where
// joints are broken some more. In words of 8.
std::size_t packed_words(const physics::BodyState& state);

// One state in a block of its own.
class PackedState {
 public:
  PackedState() = default;
  PackedState(SharedMemory& memory, const physics::BodyState& state);

  // Whether it has the bits of `state`: physics::identical().
  bool holds(const physics::BodyState& state) const;
  // Overwrites `state`; the handle must have a state.
  void unpack(physics::BodyState& state) const;
  std::span<const std::uint64_t> words() const { return words_.items(); }
  // The same block.
  friend bool operator==(const PackedState&, const PackedState&) = default;

 private:
  SharedArray<std::uint64_t> words_;
};

// A state as an item of a chunk has it: in the room of the chunk, or in a block of its own. States
// that change are written beside each other, and go with the chunk; one that rests among them gets
// its own block, which later chunks share.
class StateInChunk {
 public:
  // Writes packed_words(state) words to `room`, which must live as long as this.
  StateInChunk(const physics::BodyState& state, std::uint64_t* room);
  // `packed` has the bits of `state`.
  StateInChunk(const physics::BodyState& state, PackedState packed);
  StateInChunk(const StateInChunk&) = delete;
  StateInChunk& operator=(const StateInChunk&) = delete;
  ~StateInChunk() {
    if (!in_room()) packed_.~PackedState();
  }

  // As those of PackedState.
  bool holds(const physics::BodyState& state) const;
  void unpack(physics::BodyState& state) const;
  // Null if it is in the room of its chunk.
  const PackedState* own_block() const { return in_room() ? nullptr : &packed_; }

 private:
  bool in_room() const { return count_ > 0; }
  std::span<const std::uint64_t> words() const;

  std::uint32_t fingerprint_;  // of some of the bits: other ones, another state
  std::uint32_t count_ = 0;    // words in the room; 0: it has a block of its own
  union {
    const std::uint64_t* room_;
    PackedState packed_;
  };
};

}  // namespace soda::models
