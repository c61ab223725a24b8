// A priority queue by virtual time whose cost does not grow with the number of entries.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// A calendar queue (Brown, CACM 31, 1988): a ring of buckets, each a span of `t` and an unsorted
// list, of which only the current one is in order. Entries far ahead wait in the lists they hash
// to, turn by turn. Here the current bucket is a heap, so that a crowded bucket, as when all times
// have one `t`, costs O(log n) and not more; a queue of a few entries is that heap alone. Width and
// number of buckets are fitted to the entries from time to time.
template <class Value>
class CalendarQueue {
 public:
  // The order of the entries. Equal ones come out in any order.
  struct Key {
    std::int64_t t = 0;
    std::uint32_t round = 0;
    std::uint32_t lp = 0;

    friend bool operator==(const Key&, const Key&) = default;
    friend bool operator<(const Key& a, const Key& b) {
      if (a.t != b.t) return a.t < b.t;
      if (a.round != b.round) return a.round < b.round;
      return a.lp < b.lp;
    }
  };

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }

  // The value is constructed in place.
  template <class... Arguments>
  void push(const Key& key, Arguments&&... arguments) {
    const std::uint32_t node = take_node();
    nodes_[node].key = key;
    std::destroy_at(&nodes_[node].value);  // what was taken out of it left an empty one
    ::new (&nodes_[node].value) Value{std::forward<Arguments>(arguments)...};
    place(node);
    if (++size_ > grow_at_) [[unlikely]]
      rebuild();
  }

  // The earliest; not for an empty queue.
  const Key& top() {
    if (heap_.empty()) advance();
    return heap_.front().key;
  }

  // Takes the earliest out and puts its value at the end of `values`; not for an empty queue.
  void pop(std::vector<Value>& values) {
    if (heap_.empty()) advance();
    const std::uint32_t node = heap_.front().node;
    pop_heap();
    --size_;
    values.push_back(std::move(nodes_[node].value));
    nodes_[node].next = free_;
    free_ = node;
  }

 private:
  static constexpr std::uint32_t kNone = ~0u;
  static constexpr std::size_t kFewEntries = 48;
  static constexpr std::size_t kCrowded = 8;
  static constexpr std::int64_t kBucketsAhead = 4;

  struct alignas(sizeof(Value) > 16 ? 64 : 8) Node {  // large ones: a cache line each
    Key key;
    [[no_unique_address]] Value value{};
    std::uint32_t next = kNone;
  };
  struct HeapEntry {
    Key key;
    std::uint32_t node = kNone;
  };

  std::uint32_t take_node() {
    if (free_ == kNone) {
      nodes_.emplace_back();
      return static_cast<std::uint32_t>(nodes_.size() - 1);
    }
    return std::exchange(free_, nodes_[free_].next);
  }

  std::int64_t bucket_of(const Key& key) const { return key.t >> shift_; }
  std::uint32_t& head_of(std::int64_t bucket) {
    return heads_[static_cast<std::size_t>(bucket) & (heads_.size() - 1)];
  }

  void place(std::uint32_t node) {
    const std::int64_t bucket = bucket_of(nodes_[node].key);
    if (bucket <= current_) {
      push_heap({nodes_[node].key, node});
    } else {
      std::uint32_t& head = head_of(bucket);
      nodes_[node].next = head;
      head = node;
    }
  }

  // To the next bucket with an entry.
  void advance() {
    const std::size_t first = current_turn_;
    while (heap_.empty()) {
      if (++current_turn_ - first > heads_.size()) return rebuild();
      ++current_;
      prefetch(head_of(current_ + kBucketsAhead));
      adopt(head_of(current_));
    }
    note_work(current_turn_ - first);
  }

  // A list is a chain of cache misses; the first one of it is under way when its turn comes.
  void prefetch(std::uint32_t node) const {
    if (node != kNone) __builtin_prefetch(&nodes_[node]);
  }

  // Moves the entries of the current bucket from a list to the heap; others wait for their turn.
  void adopt(std::uint32_t& head) {
    std::uint32_t* link = &head;
    while (*link != kNone) {
      const std::uint32_t node = *link;
      if (bucket_of(nodes_[node].key) == current_) {
        *link = nodes_[node].next;
        push_heap({nodes_[node].key, node});
      } else {
        link = &nodes_[node].next;
        ++work_;
      }
    }
  }

  // Buckets passed and entries that were too many for one: where they cost more than a rebuild, the
  // width does not fit any more.
  void note_work(std::size_t passed) {
    ++adopted_;
    work_ += passed;
    if (heap_.size() > kCrowded) work_ += heap_.size();
    if (adopted_ + work_ < 16 * heads_.size()) return;
    if (work_ > 6 * adopted_) rebuild();
    adopted_ = 0;
    work_ = 0;
  }

  void rebuild() {
    std::vector<std::uint32_t> all;
    all.reserve(size_);
    for (const HeapEntry& entry : heap_) all.push_back(entry.node);
    for (std::uint32_t head : heads_)
      for (; head != kNone; head = nodes_[head].next) all.push_back(head);
    heap_.clear();
    fit(all);
    for (const std::uint32_t node : all) place(node);
    adopted_ = 0;
    work_ = 0;
  }

  // Number and width of the buckets, and the first of them.
  void fit(const std::vector<std::uint32_t>& all) {
    heads_.clear();
    grow_at_ = kFewEntries;
    current_ = kNever.t;
    if (all.size() <= kFewEntries / 2) return;
    std::vector<std::int64_t> times;
    times.reserve(all.size());
    for (const std::uint32_t node : all) times.push_back(nodes_[node].key.t);
    const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
    std::nth_element(times.begin(), middle, times.end());
    const std::int64_t earliest = *std::min_element(times.begin(), middle + 1);
    // The earlier half, for entries far ahead would make the buckets too wide.
    const std::uint64_t span =
        static_cast<std::uint64_t>(*middle) - static_cast<std::uint64_t>(earliest);
    shift_ = static_cast<int>(std::bit_width(4 * span / times.size()));
    heads_.assign(std::bit_ceil(all.size()), kNone);
    grow_at_ = 2 * heads_.size();
    current_ = earliest >> shift_;
  }

  void push_heap(const HeapEntry& entry) {
    std::size_t at = heap_.size();
    heap_.push_back(entry);
    while (at > 0) {
      const std::size_t parent = (at - 1) / 4;
      if (!(entry.key < heap_[parent].key)) break;
      heap_[at] = heap_[parent];
      at = parent;
    }
    heap_[at] = entry;
  }

  void pop_heap() {
    const HeapEntry last = heap_.back();
    heap_.pop_back();
    const std::size_t size = heap_.size();
    if (size == 0) return;
    std::size_t at = 0;
    while (true) {
      const std::size_t first = 4 * at + 1;
      if (first >= size) break;
      std::size_t least = first;
      for (std::size_t child = first + 1; child < std::min(first + 4, size); ++child)
        if (heap_[child].key < heap_[least].key) least = child;
      if (!(heap_[least].key < last.key)) break;
      heap_[at] = heap_[least];
      at = least;
    }
    heap_[at] = last;
  }

  std::vector<Node> nodes_;
  std::uint32_t free_ = kNone;
  std::size_t size_ = 0;
  std::vector<std::uint32_t> heads_;  // a power of two, or none: then all is in the heap
  int shift_ = 0;                     // log2 of the width
  std::int64_t current_ = kNever.t;   // bucket; what is not later lies in the heap
  std::size_t current_turn_ = 0;      // counts buckets passed
  std::vector<HeapEntry> heap_;       // 4-ary
  std::size_t grow_at_ = kFewEntries;
  std::size_t adopted_ = 0;  // buckets, since the fit was last judged
  std::size_t work_ = 0;     // beyond that, since then
};

}  // namespace soda::kernel
