// A body's state as one immutable block that entries share.
#pragma once

#include <cstdint>

#include "models/shared_array.hpp"
#include "physics/body_state.hpp"

namespace soda::models {

// Bits of every named field, without padding: 104 bytes and 48 a contact impulse.
class PackedState {
 public:
  PackedState() = default;
  PackedState(SharedMemory& memory, const physics::BodyState& state);

  // Whether it has the bits of `state`: physics::identical().
  bool holds(const physics::BodyState& state) const;
  // Overwrites `state`; the handle must have a state.
  void unpack(physics::BodyState& state) const;
  // The same block.
  friend bool operator==(const PackedState&, const PackedState&) = default;

 private:
  SharedArray<std::uint64_t> words_;
};

}  // namespace soda::models
