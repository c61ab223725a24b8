// What a message carries: immutable bytes, inline when they are few, shared when they are many.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {

using Bytes = std::vector<std::byte>;

// Whether a T of these bytes has them all: bytes that are padding are lost where a constant is
// computed, and a pointer has none there. The pattern is a value of every type, true for a bool.
template <class T>
constexpr bool keeps_every_byte() {
  std::array<std::byte, sizeof(T)> bytes;
  bytes.fill(std::byte{1});
  return std::bit_cast<std::array<std::byte, sizeof(T)>>(std::bit_cast<T>(bytes)) == bytes;
}

// A type of which every bit belongs to a value, so that what is compared, hashed and sent as bytes
// depends on nothing else. Numbers of any kind, floating-point ones, too, and structs and arrays of
// these without gaps. Bits decide: 0.0 and -0.0 differ, and a NaN is equal to one of the same bits.
// What is no plain struct needs a constexpr constructor, and no member of it may be a pointer
// beside a floating-point number. long double always has gaps.
template <class T>
concept WithoutPadding = std::is_trivially_copyable_v<T> &&
    (std::has_unique_object_representations_v<T> || requires {
      requires std::bool_constant < keeps_every_byte<T>()
      > ::value;
    });

// A value: copying one of up to kInlineBytes copies them, a larger one shares its bytes, so that
// executors of one process hand over large payloads without copying. 24 bytes, for the sake of a
// message that fills one cache line, which move without looking at what they are. Empty by default.
class Payload {
 public:
  static constexpr std::size_t kInlineBytes = 20;

  Payload() : bits_{} {}
  Payload(std::nullptr_t) : Payload() {}

  explicit Payload(Bytes bytes) : Payload() {
    if (bytes.size() <= kInlineBytes)
      copy_inline(bytes);
    else
      share(new Shared{1, std::move(bytes)});
  }

  explicit Payload(std::span<const std::byte> bytes) : Payload() {
    if (bytes.size() <= kInlineBytes)
      copy_inline(bytes);
    else
      share(new Shared{1, Bytes(bytes.begin(), bytes.end())});
  }

  // The bytes of `value`. Padding would make equal values unequal, so there must be none.
  template <class T>
  static Payload of(const T& value) {
    static_assert(WithoutPadding<T>);
    return Payload(std::as_bytes(std::span(&value, 1)));
  }

  Payload(const Payload& other) {
    take_bits(other);
    if (!is_inline()) [[unlikely]]
      shared()->owners.fetch_add(1, std::memory_order_relaxed);
  }
  Payload(Payload&& other) noexcept {
    take_bits(other);
    other.size_ = 0;
  }
  Payload& operator=(const Payload& other) { return *this = Payload(other); }
  Payload& operator=(Payload&& other) noexcept {
    if (this == &other) return *this;
    clear();
    take_bits(other);
    other.size_ = 0;
    return *this;
  }
  ~Payload() {
    if (!is_inline()) [[unlikely]]
      release();
  }

  void clear() {
    if (!is_inline()) [[unlikely]]
      release();
    size_ = 0;
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  // Valid until this object is moved, changed or destroyed.
  std::span<const std::byte> bytes() const {
    return {is_inline() ? bits_ : shared()->bytes.data(), size_};
  }

  friend bool operator==(const Payload& a, const Payload& b) {
    if (a.size_ != b.size_) return false;
    const std::byte* const left = a.bytes().data();
    const std::byte* const right = b.bytes().data();
    return left == right || std::memcmp(left, right, a.size_) == 0;
  }

 private:
  struct Shared {
    std::atomic<std::uint32_t> owners;
    const Bytes bytes;
  };

  bool is_inline() const { return size_ <= kInlineBytes; }
  Shared* shared() const {
    Shared* shared;
    std::memcpy(&shared, bits_, sizeof shared);
    return shared;
  }

  void copy_inline(std::span<const std::byte> bytes) {
    size_ = static_cast<std::uint32_t>(bytes.size());
    if (!bytes.empty()) std::memcpy(bits_, bytes.data(), bytes.size());
  }
  void share(Shared* shared) {
    SODA_ASSERT(shared->bytes.size() <= std::numeric_limits<std::uint32_t>::max(), "payload of ",
                shared->bytes.size(), " bytes");
    size_ = static_cast<std::uint32_t>(shared->bytes.size());
    std::memcpy(bits_, &shared, sizeof shared);
  }
  // All of them, used or not: a fixed number is copied faster than `size_` of them.
  void take_bits(const Payload& other) {
    std::memcpy(bits_, other.bits_, sizeof bits_);
    size_ = other.size_;
  }
  [[gnu::noinline]] void release() {
    if (shared()->owners.fetch_sub(1, std::memory_order_acq_rel) == 1) delete shared();
  }

  alignas(8) std::byte bits_[kInlineBytes];  // the bytes themselves, or a pointer to Shared
  std::uint32_t size_ = 0;
};

static_assert(sizeof(Payload) == 24);

}  // namespace soda::kernel
