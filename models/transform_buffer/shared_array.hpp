// Immutable arrays that are counted by their references: what entries of a transform buffer share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

namespace soda::models {

// Bytes that arrays take from the heap, with what an allocator adds to each: a word, and rounding
// up to 16 (glibc). Outlives its arrays.
struct SharedMemory {
  std::uint64_t taken_bytes = 0;  // ever
  std::uint64_t live_bytes = 0;   // now
};

// A handle of an array that never changes; copies share it. Empty: no memory. The references are
// counted without synchronisation: all handles of an array belong to one thread at a time, here
// that of the world whose buffer holds them.
template <class T>
class SharedArray {
 public:
  SharedArray() = default;
  // A copy of `items`.
  SharedArray(SharedMemory& memory, std::span<const T> items)
      : SharedArray(memory, items.size(), [items](T* first) {
          std::uninitialized_copy(items.begin(), items.end(), first);
        }) {}
  // `fill(first)` constructs `count` items from `first` on, and does not throw.
  template <class Fill>
  SharedArray(SharedMemory& memory, std::size_t count, Fill fill)
      : SharedArray(memory, count, 0, [&fill](T* first, std::byte*) { fill(first); }) {}
  // The same with `room` bytes beside the items that live as long as they do: `fill(first, room)`.
  // The room has the alignment of the items; no destructor is called for what is put there.
  template <class Fill>
  SharedArray(SharedMemory& memory, std::size_t count, std::size_t room, Fill fill) {
    if (count == 0) return;
    header_ = ::new (::operator new(sizeof(Header) + count * sizeof(T) + room))
        Header{&memory, room, 1, static_cast<std::uint32_t>(count)};
    fill(first(), reinterpret_cast<std::byte*>(first() + count));
    memory.taken_bytes += header_->heap_bytes();
    memory.live_bytes += header_->heap_bytes();
  }
  SharedArray(const SharedArray& other) : header_(other.header_) {
    if (header_ != nullptr) ++header_->references;
  }
  SharedArray(SharedArray&& other) noexcept : header_(std::exchange(other.header_, nullptr)) {}
  SharedArray& operator=(SharedArray other) noexcept {
    std::swap(header_, other.header_);
    return *this;
  }
  ~SharedArray() {
    if (header_ == nullptr || --header_->references > 0) return;
    header_->memory->live_bytes -= header_->heap_bytes();
    std::destroy_n(first(), header_->count);
    ::operator delete(header_);
  }

  std::span<const T> items() const {
    return header_ == nullptr ? std::span<const T>() : std::span<const T>(first(), header_->count);
  }
  // The same array, not only an equal one.
  friend bool operator==(const SharedArray& a, const SharedArray& b) {
    return a.header_ == b.header_;
  }

 private:
  struct Header {
    SharedMemory* memory;
    std::size_t room;
    std::uint32_t references, count;

    std::size_t heap_bytes() const {
      return (sizeof(Header) + count * sizeof(T) + room + sizeof(void*) + 15) / 16 * 16;
    }
  };
  static_assert(alignof(T) <= alignof(Header), "items follow their header");

  T* first() const { return reinterpret_cast<T*>(header_ + 1); }

  Header* header_ = nullptr;
};

}  // namespace soda::models
