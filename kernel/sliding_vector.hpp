// A vector that also gives up elements at its front, in amortised constant time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
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
  SlidingVector(SlidingVector&& other) noexcept
      : items_(std::exchange(other.items_, nullptr)),
        head_(std::exchange(other.head_, 0u)),
        tail_(std::exchange(other.tail_, 0u)),
        capacity_(std::exchange(other.capacity_, 0u)) {}
  SlidingVector(const SlidingVector& other) {
    for (const T& item : other) push_back(item);
  }
  SlidingVector& operator=(SlidingVector other) noexcept {
    std::swap(items_, other.items_);
    std::swap(head_, other.head_);
    std::swap(tail_, other.tail_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }
  ~SlidingVector() {
    std::destroy(begin(), end());
    std::allocator<T>().deallocate(items_, capacity_);
  }

  bool empty() const { return head_ == tail_; }
  std::size_t size() const { return tail_ - head_; }
  T& operator[](std::size_t index) { return items_[head_ + index]; }
  const T& operator[](std::size_t index) const { return items_[head_ + index]; }
  T& front() { return items_[head_]; }
  const T& front() const { return items_[head_]; }
  T& back() { return items_[tail_ - 1]; }
  const T& back() const { return items_[tail_ - 1]; }
  T* begin() { return items_ + head_; }
  const T* begin() const { return items_ + head_; }
  T* end() { return items_ + tail_; }
  const T* end() const { return items_ + tail_; }

  void push_back(T item) { emplace_back(std::move(item)); }

  // Constructed in place. Arguments must not refer to elements.
  template <class... Arguments>
  T& emplace_back(Arguments&&... arguments) {
    if (tail_ == capacity_) make_room();
    T* const item = std::construct_at(items_ + tail_, std::forward<Arguments>(arguments)...);
    ++tail_;
    return *item;
  }

  // Before the element at `index` (<= size()); moves what comes after it.
  void insert(std::size_t index, T item) {
    push_back(std::move(item));
    if (index + 1 < size()) std::rotate(begin() + index, end() - 1, end());
  }

  // Keeps the first `count` elements.
  void truncate(std::size_t count) {
    std::destroy(begin() + count, end());
    tail_ = head_ + static_cast<std::uint32_t>(count);
  }

  void erase(std::size_t first, std::size_t last) {
    T* const rest = std::move(begin() + last, end(), begin() + first);
    truncate(static_cast<std::size_t>(rest - begin()));
  }

  // Few that remain slide to the front at once, while they are in the cache.
  void drop_front(std::size_t count) {
    std::destroy(begin(), begin() + count);
    head_ += static_cast<std::uint32_t>(count);
    if (size() <= std::min<std::size_t>(head_, kFew)) slide();
  }

 private:
  static constexpr std::size_t kFew = 2;

  void slide() {
    const std::uint32_t count = tail_ - head_;
    move_to(items_);
    head_ = 0;
    tail_ = count;
  }

  // At the back: by sliding to the front of the same memory if that is at least half free.
  void make_room() {
    const std::uint32_t count = tail_ - head_;
    if (2 * count <= capacity_ && capacity_ > 0) return slide();
    const std::uint32_t larger = std::max(2u, 2 * capacity_);
    T* const items = std::allocator<T>().allocate(larger);
    move_to(items);
    std::allocator<T>().deallocate(items_, capacity_);
    items_ = items;
    capacity_ = larger;
    head_ = 0;
    tail_ = count;
  }

  // `to` is other memory, or earlier in the same.
  void move_to(T* to) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      if (size() <= kFew) {  // usual, and no call
        for (const T* item = begin(); item != end(); ++item, ++to) *to = *item;
      } else {
        std::memmove(static_cast<void*>(to), begin(), size() * sizeof(T));
      }
    } else {
      for (T* item = begin(); item != end(); ++item, ++to) {
        std::construct_at(to, std::move(*item));
        std::destroy_at(item);
      }
    }
  }

  T* items_ = nullptr;
  std::uint32_t head_ = 0;
  std::uint32_t tail_ = 0;
  std::uint32_t capacity_ = 0;
};

}  // namespace soda::kernel
