// Messages and states as types of the model: payloads of plain structs, handlers by message.
#pragma once

#include <cstring>
#include <type_traits>

#include "kernel/api/invariant.hpp"
#include "kernel/api/logical_process.hpp"

namespace soda::kernel {

// A struct that is a message: it may be copied byte by byte, has no padding (payload.hpp), and says
// its kind, which no other message of the model has:
//   struct Arrival { static constexpr std::uint32_t kKind = 1; double service_ticks; };
template <class T>
concept TypedMessage = WithoutPadding<T> && requires {
  std::uint32_t{T::kKind};
};

template <TypedMessage T>
void send(Outbox& outbox, LpId destination, VirtualTime when, const T& message) {
  outbox.send(destination, when, T::kKind, Payload::of(message));
}

template <TypedMessage T>
bool is(const MessageView& message) {
  return message.kind == T::kKind;
}

// The message, which is<T>(); of another size it is a broken model, which aborts.
template <TypedMessage T>
T read(const MessageView& message) {
  SODA_ASSERT(message.kind == T::kKind && message.payload.size() == sizeof(T), "message of kind ",
              message.kind, " and ", message.payload.size(), " bytes read as kind ", T::kKind,
              " of ", sizeof(T));
  T value;
  std::memcpy(&value, message.payload.data(), sizeof value);
  return value;
}

}  // namespace soda::kernel
