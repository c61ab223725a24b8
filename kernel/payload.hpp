// What a message carries: immutable bytes, inline when they are few, shared when they are many.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernel/invariant.hpp"

namespace soda::kernel {

using Bytes = std::vector<std::byte>;

// A value: copying one of up to kInlineBytes copies them, a larger one shares its bytes, so that
// executors of one process hand over large payloads without copying. 24 bytes, for the sake of a
// message that fills one cache line. Empty by default.
class Payload {
 public:
  static constexpr std::size_t kInlineBytes = 20;

  Payload() = default;
  Payload(std::nullptr_t) {}

  explicit Payload(Bytes bytes) {
    if (bytes.size() <= kInlineBytes)
      copy_inline(bytes);
    else
      share(std::make_shared<const Bytes>(std::move(bytes)));
  }

  explicit Payload(std::span<const std::byte> bytes) {
    if (bytes.size() <= kInlineBytes)
      copy_inline(bytes);
    else
      share(std::make_shared<const Bytes>(bytes.begin(), bytes.end()));
  }

  // The bytes of `value`. Padding would make equal values unequal, so there must be none.
  template <class T>
  static Payload of(const T& value) {
    static_assert(std::has_unique_object_representations_v<T>);
    return Payload(std::as_bytes(std::span(&value, 1)));
  }

  Payload(const Payload& other) {
    if (other.is_inline())
      take_bits(other);
    else
      share(other.shared());
  }
  Payload(Payload&& other) noexcept {
    if (other.is_inline())
      take_bits(other);
    else
      take_shared(other);
  }
  Payload& operator=(const Payload& other) { return *this = Payload(other); }
  Payload& operator=(Payload&& other) noexcept {
    if (this == &other) return *this;
    release();
    if (other.is_inline())
      take_bits(other);
    else
      take_shared(other);
    return *this;
  }
  ~Payload() { release(); }

  void clear() { release(); }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  // Valid until this object is moved, changed or destroyed.
  std::span<const std::byte> bytes() const {
    return {is_inline() ? inline_ : shared()->data(), size_};
  }

  friend bool operator==(const Payload& a, const Payload& b) {
    if (a.size_ != b.size_) return false;
    const std::byte* const left = a.bytes().data();
    const std::byte* const right = b.bytes().data();
    return left == right || std::memcmp(left, right, a.size_) == 0;
  }

 private:
  using Shared = std::shared_ptr<const Bytes>;

  bool is_inline() const { return size_ <= kInlineBytes; }
  Shared& shared() { return *std::launder(reinterpret_cast<Shared*>(inline_)); }
  const Shared& shared() const { return *std::launder(reinterpret_cast<const Shared*>(inline_)); }

  void copy_inline(std::span<const std::byte> bytes) {
    size_ = static_cast<std::uint32_t>(bytes.size());
    if (!bytes.empty()) std::memcpy(inline_, bytes.data(), bytes.size());
  }
  void share(Shared bytes) {
    SODA_ASSERT(bytes->size() <= std::numeric_limits<std::uint32_t>::max(), "payload of ",
                bytes->size(), " bytes");
    size_ = static_cast<std::uint32_t>(bytes->size());
    new (inline_) Shared(std::move(bytes));
  }
  // All inline bytes, used or not: a fixed number is copied faster than `size_` of them.
  void take_bits(const Payload& other) {
    std::memcpy(inline_, other.inline_, sizeof inline_);
    size_ = other.size_;
  }
  void take_shared(Payload& other) {
    share(std::move(other.shared()));
    other.release();
  }
  void release() {
    if (!is_inline()) [[unlikely]]
      shared().~Shared();
    size_ = 0;
  }

  alignas(Shared) std::byte inline_[kInlineBytes] = {};
  std::uint32_t size_ = 0;
  static_assert(sizeof(Shared) <= kInlineBytes);
};

static_assert(sizeof(Payload) == 24);

}  // namespace soda::kernel
