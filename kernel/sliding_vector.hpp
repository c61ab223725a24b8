// A vector that also gives up elements at its front, in amortised constant time.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace soda::kernel {

// History of an LP: appended at the back, cut off at the back by a rollback, dropped at the front
// by fossil collection, seldom changed in the middle. Contiguous, so that binary search works, and
// nothing is allocated while it is empty (std::deque takes 576 bytes per instance for nothing).
template <class T>
class SlidingVector {
 public:
  bool empty() const { return head_ == items_.size(); }
  std::size_t size() const { return items_.size() - head_; }
  T& operator[](std::size_t index) { return items_[head_ + index]; }
  const T& operator[](std::size_t index) const { return items_[head_ + index]; }
  T& front() { return items_[head_]; }
  const T& front() const { return items_[head_]; }
  T& back() { return items_.back(); }
  const T& back() const { return items_.back(); }
  T* begin() { return items_.data() + head_; }
  const T* begin() const { return items_.data() + head_; }
  T* end() { return items_.data() + items_.size(); }
  const T* end() const { return items_.data() + items_.size(); }

  void push_back(T item) { items_.push_back(std::move(item)); }

  // Before the element at `index` (<= size()); moves what comes after it.
  void insert(std::size_t index, T item) {
    items_.insert(items_.begin() + offset(index), std::move(item));
  }

  // Keeps the first `count` elements.
  void truncate(std::size_t count) { items_.erase(items_.begin() + offset(count), items_.end()); }

  void erase(std::size_t first, std::size_t last) {
    items_.erase(items_.begin() + offset(first), items_.begin() + offset(last));
  }

  // What the dropped elements own is released at once, their own bytes when they are the majority.
  void drop_front(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) items_[head_ + i] = T{};
    head_ += count;
    if (head_ >= size()) {
      items_.erase(items_.begin(), items_.begin() + offset(0));
      head_ = 0;
    }
  }

 private:
  std::ptrdiff_t offset(std::size_t index) const {
    return static_cast<std::ptrdiff_t>(head_ + index);
  }

  std::vector<T> items_;
  std::size_t head_ = 0;
};

}  // namespace soda::kernel
