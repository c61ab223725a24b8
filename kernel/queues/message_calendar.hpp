// The messages that the LPs of one worker will receive, the earliest first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernel/api/virtual_time.hpp"
#include "kernel/queues/four_ary_heap.hpp"
#include "kernel/queues/message_pool.hpp"

namespace soda::kernel {

// A calendar queue by (time, destination) at a cost that does not grow with the number of messages:
// a ring of buckets, each a span of `t` and a list that is linked through the messages themselves,
// which lie in the pool. Only the current bucket is in order. Messages far ahead wait in
// the lists they hash to, turn by turn; width and number of buckets are fitted from time to time.
class MessageCalendar {
 public:
  // `pool` must outlive the calendar, which leaves its messages there.
  explicit MessageCalendar(MessagePool& pool) : pool_(pool) {}

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }

  // A message that lies in the pool, in no list.
  [[gnu::always_inline]] void push(std::uint32_t place) {
    const Message& message = pool_[place];
    ++size_;
    const std::int64_t bucket = message.time.t >> shift_;
    if (bucket <= current_)
      heap_.push(entry_of(place));
    else
      list(place, bucket);
    if (size_ > grow_at_) [[unlikely]]
      rebuild();
  }

  // kNever if there is none.
  VirtualTime top_time() {
    if (heap_.empty()) {
      if (size_ == 0) return kNever;
      advance();
    }
    return {heap_.top().t, heap_.top().round};
  }

  // Of the top; top_time() has just been called and was not kNever.
  LpId top_lp() const { return LpId{heap_.top().lp}; }
  std::uint32_t top_place() const { return heap_.top().place; }

  // Whether the top, if it can be told without looking further, has this key.
  bool has_more(VirtualTime time, LpId lp) const {
    if (heap_.empty()) return false;  // equal times share a bucket
    const Entry& top = heap_.top();
    return top.t == time.t && top.round == time.round && top.lp == index_of(lp);
  }

  // Takes the top out; it stays in the pool.
  std::uint32_t pop() {
    const std::uint32_t place = heap_.top().place;
    heap_.pop();
    --size_;
    return place;
  }

 private:
  static constexpr std::uint32_t kNone = MessagePool::kNone;
  static constexpr std::size_t kFew = 32;  // all of so few lie in the heap
  static constexpr std::size_t kCrowded = 8;
  static constexpr std::int64_t kBucketsAhead = 4;

  struct Entry {
    std::int64_t t;
    std::uint32_t lp;
    std::uint32_t round;
    std::uint32_t place;

    friend bool operator<(const Entry& a, const Entry& b) {
      return a.t < b.t || (a.t == b.t && a.round_and_lp() < b.round_and_lp());
    }

   private:
    std::uint64_t round_and_lp() const { return (std::uint64_t{round} << 32) + lp; }
  };

  Entry entry_of(std::uint32_t place) const {
    const Message& message = pool_[place];
    return {message.time.t, index_of(message.destination), message.time.round, place};
  }
  std::uint32_t& head_of(std::int64_t bucket) {
    return heads_[static_cast<std::size_t>(bucket) & mask_];
  }
  void list(std::uint32_t place, std::int64_t bucket) {
    std::uint32_t& head = head_of(bucket);
    pool_[place].next = head;
    head = place;
  }
  void advance();
  void adopt(std::uint32_t& head);
  void note_work(std::size_t passed);
  void rebuild();
  void fit(const std::vector<std::uint32_t>& all);

  MessagePool& pool_;
  ShortHeap<Entry> heap_;            // the current bucket
  std::int64_t current_ = kNever.t;  // bucket; what is not later lies in the heap
  int shift_ = 0;                    // log2 of the width of a bucket
  std::size_t size_ = 0;
  std::size_t grow_at_ = kFew;        // then there are too few buckets
  std::vector<std::uint32_t> heads_;  // of the buckets; a power of two
  std::size_t mask_ = 0;              // one less than that
  std::size_t adopted_ = 0;           // buckets, since the fit was last judged
  std::size_t work_ = 0;              // beyond that, since then
};

}  // namespace soda::kernel
