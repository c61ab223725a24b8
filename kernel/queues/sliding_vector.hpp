// A vector that also gives up elements at its front, in amortised constant time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <type_traits>
#include <utility>

namespace soda::kernel {

// History of an LP: appended at the back, cut off at the back by a rollback, dropped at the front
// by fossil collection, seldom changed in the middle. Contiguous, so that binary search works, and
// nothing is allocated while it is empty (std::deque takes 576 bytes per instance for nothing).
template <class T>
class SlidingVector {
 public:
  SlidingVector() = default;
  SlidingVector(SlidingVector&& other) noexcept { swap(other); }
  SlidingVector(const SlidingVector& other) {
    for (const T& item : other) push_back(item);
  }
  SlidingVector& operator=(SlidingVector other) noexcept {
    swap(other);
    return *this;
  }
  ~SlidingVector() {
    std::destroy(begin_, end_);
    std::allocator<T>().deallocate(items_, capacity());
  }

  bool empty() const { return begin_ == end_; }
  std::size_t size() const { return static_cast<std::size_t>(end_ - begin_); }
  T& operator[](std::size_t index) { return begin_[index]; }
  const T& operator[](std::size_t index) const { return begin_[index]; }
  T& front() { return *begin_; }
  const T& front() const { return *begin_; }
  T& back() { return end_[-1]; }
  const T& back() const { return end_[-1]; }
  T* begin() { return begin_; }
  const T* begin() const { return begin_; }
  T* end() { return end_; }
  const T* end() const { return end_; }

  void push_back(T item) { emplace_back(std::move(item)); }

  // Constructed in place. Arguments must not refer to elements.
  template <class... Arguments>
  T& emplace_back(Arguments&&... arguments) {
    if (end_ == limit_) [[unlikely]]
      make_room();
    return *std::construct_at(end_++, std::forward<Arguments>(arguments)...);
  }

  // `count` elements that lie elsewhere; to be copied as bytes.
  void append(const T* items, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (static_cast<std::size_t>(limit_ - end_) < count) [[unlikely]]
      make_room(count);
    std::memcpy(static_cast<void*>(end_), items, count * sizeof(T));
    end_ += count;
  }

  // Before the element at `index` (<= size()); moves what comes after it.
  void insert(std::size_t index, T item) {
    if (index == size()) {
      emplace_back(std::move(item));
      return;
    }
    if (end_ == limit_) [[unlikely]]
      make_room();
    std::construct_at(end_, std::move(end_[-1]));
    T* const place = begin_ + index;
    for (T* last = end_ - 1; last != place; --last) *last = std::move(last[-1]);
    *place = std::move(item);
    ++end_;
  }

  // Keeps the first `count` elements.
  void truncate(std::size_t count) {
    std::destroy(begin_ + count, end_);
    end_ = begin_ + count;
  }

  void erase(std::size_t first, std::size_t last) {
    T* const rest = std::move(begin_ + last, end_, begin_ + first);
    truncate(static_cast<std::size_t>(rest - begin_));
  }

  void drop_front(std::size_t count) {
    T* const rest = begin_ + count;
    std::destroy(begin_, rest);
    begin_ = rest;
    if (begin_ == end_) begin_ = end_ = items_;
  }

 private:
  std::size_t capacity() const { return static_cast<std::size_t>(limit_ - items_); }

  void swap(SlidingVector& other) {
    std::swap(items_, other.items_);
    std::swap(begin_, other.begin_);
    std::swap(end_, other.end_);
    std::swap(limit_, other.limit_);
  }

  // At the back: by sliding to the front of the same memory if a quarter of that is free. Half
  // would spread what slides over more of the cache.
  [[gnu::noinline]] void make_room(std::size_t more = 1) {
    const std::size_t count = size();
    if (4 * (count + more - 1) <= 3 * capacity() && capacity() > 0) {
      move_to(items_);
    } else {
      const std::size_t larger = std::max({kLeast, 2 * capacity(), 2 * more});
      T* const items = std::allocator<T>().allocate(larger);
      move_to(items);
      std::allocator<T>().deallocate(items_, capacity());
      items_ = items;
      limit_ = items + larger;
    }
    begin_ = items_;
    end_ = items_ + count;
  }

  // `to` is other memory, or earlier in the same.
  void move_to(T* to) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      if (!empty()) std::memmove(static_cast<void*>(to), begin_, size() * sizeof(T));
    } else {
      for (T* item = begin_; item != end_; ++item, ++to) {
        std::construct_at(to, std::move(*item));
        std::destroy_at(item);
      }
    }
  }

  static constexpr std::size_t kLeast = sizeof(T) < 32 ? 4 : 2;  // about a cache line

  T* items_ = nullptr;
  T* begin_ = nullptr;
  T* end_ = nullptr;
  T* limit_ = nullptr;
};

}  // namespace soda::kernel
