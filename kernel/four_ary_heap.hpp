// A heap of small values, the least on top.
#pragma once

#include <cstddef>
#include <vector>

namespace soda::kernel {

// Four children a node: one cache line of them, and half the levels of a binary heap.
template <class Entry>
class FourAryHeap {
 public:
  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return entries_.size(); }
  void clear() { entries_.clear(); }
  // Not of an empty heap.
  const Entry& top() const { return entries_.front(); }
  // In any order.
  const std::vector<Entry>& entries() const { return entries_; }

  void push(const Entry& entry) {
    std::size_t at = entries_.size();
    entries_.push_back(entry);
    while (at > 0) {
      const std::size_t parent = (at - 1) / 4;
      if (!(entry < entries_[parent])) break;
      entries_[at] = entries_[parent];
      at = parent;
    }
    entries_[at] = entry;
  }

  void pop() {
    const std::size_t size = entries_.size() - 1;
    const Entry last = entries_[size];
    entries_.pop_back();
    if (size <= 1) {
      if (size == 1) entries_[0] = last;
      return;
    }
    std::size_t at = 0;
    for (std::size_t first = 1; first < size; first = 4 * at + 1) {
      std::size_t least = first;
      const std::size_t end = first + 4 < size ? first + 4 : size;
      for (std::size_t child = first + 1; child < end; ++child)
        if (entries_[child] < entries_[least]) least = child;
      if (!(entries_[least] < last)) break;
      entries_[at] = entries_[least];
      at = least;
    }
    entries_[at] = last;
  }

 private:
  std::vector<Entry> entries_;
};

}  // namespace soda::kernel
