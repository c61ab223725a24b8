// Messages as bytes between ranks: named fields, little-endian, no padding.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "kernel/api/invariant.hpp"
#include "kernel/api/message.hpp"

namespace soda::kernel {

static_assert(std::endian::native == std::endian::little, "the wire format is little-endian");

// A value whose bytes say all of it: no padding, no pointers.
template <class T>
void append_plain(Bytes& bytes, const T& value) {
  static_assert(WithoutPadding<T>);
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

template <class T>
T take_plain(std::span<const std::byte>& bytes) {
  static_assert(WithoutPadding<T>);
  SODA_ASSERT(bytes.size() >= sizeof(T), "a packet ends early");
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes = bytes.subspan(sizeof value);
  return value;
}

template <class T>
void append_number(Bytes& bytes, T value) {
  static_assert(std::is_integral_v<T>);
  append_plain(bytes, value);
}

template <class T>
T take_number(std::span<const std::byte>& bytes) {
  static_assert(std::is_integral_v<T>);
  return take_plain<T>(bytes);
}

inline void append_message(Bytes& bytes, const Message& message) {
  append_number(bytes, message.time.t);
  append_number(bytes, message.time.round);
  append_number(bytes, index_of(message.source));
  append_number(bytes, index_of(message.destination));
  append_number(bytes, message.kind);
  append_number(bytes, message.slot);
  append_number(bytes, std::uint64_t{message.version} << 2 | std::uint64_t{message.first} << 1 |
                           std::uint64_t{message.anti});
  const std::span<const std::byte> payload = message.payload.bytes();
  append_number(bytes, static_cast<std::uint32_t>(payload.size()));
  bytes.insert(bytes.end(), payload.begin(), payload.end());
}

inline Message take_message(std::span<const std::byte>& bytes) {
  Message message;
  message.time.t = take_number<std::int64_t>(bytes);
  message.time.round = take_number<std::uint32_t>(bytes);
  message.source = LpId{take_number<std::uint32_t>(bytes)};
  message.destination = LpId{take_number<std::uint32_t>(bytes)};
  message.kind = take_number<std::uint32_t>(bytes);
  message.slot = take_number<std::uint32_t>(bytes);
  const auto version = take_number<std::uint64_t>(bytes);
  message.version = version >> 2;
  message.first = (version & 2) != 0;
  message.anti = (version & 1) != 0;
  const auto size = take_number<std::uint32_t>(bytes);
  SODA_ASSERT(bytes.size() >= size, "a packet ends early");
  message.payload = Payload(bytes.first(size));
  bytes = bytes.subspan(size);
  return message;
}

}  // namespace soda::kernel
