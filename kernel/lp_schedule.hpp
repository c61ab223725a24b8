// The LPs of one worker, the one with the earliest floor on top.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernel/virtual_time.hpp"

namespace soda::kernel {

// As LpHeap, for many LPs and frequent changes, at a cost that does not grow with their number: a
// calendar queue (calendar_queue.hpp) whose entries are the LPs themselves, linked. Only the
// current bucket is in order, as a heap; entries of it that are no longer true are dropped when
// they come to the top.
class LpSchedule {
 public:
  explicit LpSchedule(std::size_t size) : nodes_(size) {}

  std::size_t size() const { return nodes_.size(); }
  VirtualTime time_of(std::uint32_t lp) const { return nodes_[lp].time(); }

  // kNever: nothing to do.
  void update(std::uint32_t lp, VirtualTime time) {
    Node& node = nodes_[lp];
    if (node.t == time.t && node.round == time.round) return;
    if (node.is_listed) unlink(node);
    node.t = time.t;
    node.round = time.round;
    if (time != kNever) place(lp);
  }

  // The earliest time of all; kNever if there is nothing to do.
  VirtualTime top_time() {
    while (true) {
      if (heap_.empty()) {
        if (listed_ == 0) return kNever;
        advance();
        continue;
      }
      const Entry& top = heap_.front();
      if (nodes_[top.lp].t == top.t && nodes_[top.lp].round == top.round) return {top.t, top.round};
      pop_heap();
    }
  }

  // The LP that take() would take out; as for that, top_time() was not kNever.
  std::uint32_t top() const { return heap_.front().lp; }

  // Takes out the lowest LP of top_time(), which has just been called and was not kNever: it has
  // nothing to do until it is updated.
  std::uint32_t take() {
    const std::uint32_t lp = heap_.front().lp;
    pop_heap();
    nodes_[lp].t = kNever.t;
    nodes_[lp].round = kNever.round;
    return lp;
  }

 private:
  static constexpr std::uint32_t kNone = ~0u;
  static constexpr std::size_t kFewLps = 24;
  static constexpr std::size_t kMostOfFew = 128;  // in the heap, untrue ones included
  static constexpr std::size_t kCrowded = 8;

  // One LP. If it is listed, it is in the list of a bucket; if not, it is in the heap unless its
  // time is kNever.
  struct Node {
    std::int64_t t = kNever.t;
    std::uint32_t round = kNever.round;
    std::uint32_t next = kNone;
    std::uint32_t previous = kNone;  // none: the head of its bucket leads here
    bool is_listed = false;

    VirtualTime time() const { return {t, round}; }
  };
  struct Entry {
    std::int64_t t;
    std::uint32_t round;
    std::uint32_t lp;

    friend bool operator<(const Entry& a, const Entry& b) {
      if (a.t != b.t) return a.t < b.t;
      if (a.round != b.round) return a.round < b.round;
      return a.lp < b.lp;
    }
  };

  std::int64_t bucket_of(std::int64_t t) const { return t >> shift_; }
  std::uint32_t& head_of(std::int64_t bucket) {
    return heads_[static_cast<std::size_t>(bucket) & mask_];
  }

  void place(std::uint32_t lp) {
    Node& node = nodes_[lp];
    const std::int64_t bucket = bucket_of(node.t);
    if (bucket <= current_) {
      push_heap({node.t, node.round, lp});
      if (heap_.size() > most_in_heap_) rebuild();
      return;
    }
    std::uint32_t& head = head_of(bucket);
    node.next = head;
    node.previous = kNone;
    node.is_listed = true;
    if (head != kNone) nodes_[head].previous = lp;
    head = lp;
    if (++listed_ > most_listed_) rebuild();
  }

  void unlink(Node& node) {
    if (node.next != kNone) nodes_[node.next].previous = node.previous;
    if (node.previous != kNone)
      nodes_[node.previous].next = node.next;
    else
      head_of(bucket_of(node.t)) = node.next;
    node.is_listed = false;
    --listed_;
  }

  void advance();
  void adopt(std::uint32_t first);
  void note_work(std::size_t passed);
  void rebuild();
  void fit(const std::vector<std::uint32_t>& all);
  void push_heap(const Entry& entry);
  void pop_heap();

  std::vector<Node> nodes_;           // of each LP
  std::vector<Entry> heap_;           // 4-ary
  std::vector<std::uint32_t> heads_;  // of the buckets; a power of two
  std::size_t mask_ = 0;              // one less than that
  std::size_t most_listed_ = 0;       // then there are too few buckets
  std::int64_t current_ = kNever.t;   // bucket; what is not later lies in the heap
  int shift_ = 0;                     // log2 of the width of a bucket
  std::size_t listed_ = 0;
  std::size_t most_in_heap_ = kMostOfFew;  // then it is time to drop untrue ones
  std::size_t adopted_ = 0;                // buckets, since the fit was last judged
  std::size_t work_ = 0;                   // beyond that, since then
};

inline void LpSchedule::push_heap(const Entry& entry) {
  std::size_t at = heap_.size();
  heap_.push_back(entry);
  if (at == 0) return;
  while (at > 0) {
    const std::size_t parent = (at - 1) / 4;
    if (!(entry < heap_[parent])) break;
    heap_[at] = heap_[parent];
    at = parent;
  }
  heap_[at] = entry;
}

inline void LpSchedule::pop_heap() {
  const std::size_t size = heap_.size() - 1;
  const Entry last = heap_[size];
  heap_.pop_back();
  if (size <= 1) {
    if (size == 1) heap_[0] = last;
    return;
  }
  std::size_t at = 0;
  for (std::size_t first = 1; first < size; first = 4 * at + 1) {
    std::size_t least = first;
    const std::size_t end = first + 4 < size ? first + 4 : size;
    for (std::size_t child = first + 1; child < end; ++child)
      if (heap_[child] < heap_[least]) least = child;
    if (!(heap_[least] < last)) break;
    heap_[at] = heap_[least];
    at = least;
  }
  heap_[at] = last;
}

}  // namespace soda::kernel
