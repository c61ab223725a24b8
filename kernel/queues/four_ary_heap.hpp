// Heaps of small values, the least on top.
#pragma once

#include <algorithm>
#include <array>
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

// The same for what is nearly always short: the least few lie in order, where putting one in and
// taking the least out is a matter of a move or two; only what is beyond them lies in a heap.
template <class Entry>
class ShortHeap {
 public:
  bool empty() const { return count_ == 0; }
  std::size_t size() const { return count_ + rest_.size(); }
  void clear() {
    count_ = 0;
    rest_.clear();
  }
  // Not of an empty heap.
  const Entry& top() const { return few_[count_ - 1]; }

  // By value: what is referred to would be put together in memory first, and waited for there.
  [[gnu::always_inline]] void push(Entry entry) {
    if (count_ == kMost) [[unlikely]]
      spill();
    if (!rest_.empty() && few_[0] < entry) [[unlikely]]
      return push_rest(entry);
    std::size_t at = count_++;
    for (; at > 0 && few_[at - 1] < entry; --at) few_[at] = few_[at - 1];
    few_[at] = entry;
  }

  void pop() {
    if (--count_ == 0 && !rest_.empty()) [[unlikely]]
      refill();
  }

  // Appended to `entries`, in any order.
  void append_to(std::vector<Entry>& entries) const {
    entries.insert(entries.end(), few_.begin(), few_.begin() + count_);
    entries.insert(entries.end(), rest_.entries().begin(), rest_.entries().end());
  }

 private:
  static constexpr std::size_t kMost = 16;

  [[gnu::noinline]] void push_rest(Entry entry) { rest_.push(entry); }

  // The later half of the few.
  [[gnu::noinline]] void spill() {
    for (std::size_t i = 0; i < kMost / 2; ++i) rest_.push(few_[i]);
    std::copy(few_.begin() + kMost / 2, few_.end(), few_.begin());
    count_ = kMost / 2;
  }

  [[gnu::noinline]] void refill() {
    count_ = std::min(kMost / 2, rest_.size());
    for (std::size_t i = count_; i > 0; --i) {
      few_[i - 1] = rest_.top();
      rest_.pop();
    }
  }

  std::array<Entry, kMost> few_{};  // latest first; all of rest_ is as late as the first or later
  std::size_t count_ = 0;           // 0 only if rest_ is empty
  FourAryHeap<Entry> rest_;
};

}  // namespace soda::kernel
