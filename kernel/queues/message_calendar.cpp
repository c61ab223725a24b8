#include "kernel/queues/message_calendar.hpp"

#include <algorithm>
#include <bit>

namespace soda::kernel {

// Moves those of the current bucket from the list to the heap; others wait for their turn.
inline void MessageCalendar::adopt(std::uint32_t& head) {
  for (std::uint32_t* link = &head; *link != kNone;) {
    const std::uint32_t place = *link;
    Message& message = pool_[place];
    if (message.time.t >> shift_ == current_) {
      *link = message.next;
      heap_.push(entry_of(place));
    } else {
      link = &message.next;
      ++work_;
    }
  }
}

// Buckets passed and messages that were too many for one: where they cost more than a rebuild, the
// width does not fit any more.
inline void MessageCalendar::note_work(std::size_t passed) {
  ++adopted_;
  work_ += passed;
  if (heap_.size() > kCrowded) work_ += heap_.size();
  if (adopted_ + work_ < 16 * heads_.size()) return;
  if (work_ > 6 * adopted_) rebuild();
  adopted_ = 0;
  work_ = 0;
}

// To the next bucket with a message; there is one.
void MessageCalendar::advance() {
  for (std::size_t passed = 1;; ++passed) {
    if (passed > heads_.size()) return rebuild();
    ++current_;
    // A list is a chain of cache misses: when its turn comes, the first two are under way.
    const std::uint32_t ahead = head_of(current_ + kBucketsAhead);
    if (ahead != kNone) __builtin_prefetch(&pool_[ahead]);
    const std::uint32_t soon = head_of(current_ + kBucketsAhead / 2);
    if (soon != kNone && pool_[soon].next != kNone) __builtin_prefetch(&pool_[pool_[soon].next]);
    std::uint32_t& head = head_of(current_);
    if (head == kNone) continue;
    adopt(head);
    if (!heap_.empty()) return note_work(passed);
  }
}

void MessageCalendar::rebuild() {
  std::vector<std::uint32_t> all;
  all.reserve(size_);
  std::vector<Entry> current;
  heap_.append_to(current);
  for (const Entry& entry : current) all.push_back(entry.place);
  for (std::uint32_t head : heads_)
    for (; head != kNone; head = pool_[head].next) all.push_back(head);
  heap_.clear();
  fit(all);
  for (const std::uint32_t place : all) {
    const std::int64_t bucket = pool_[place].time.t >> shift_;
    if (bucket <= current_)
      heap_.push(entry_of(place));
    else
      list(place, bucket);
  }
  adopted_ = 0;
  work_ = 0;
}

// Number and width of the buckets, and the first of them. The same rule as the oracle's queue, but
// not its code (docs/decisions/kernel-separate-oracle.md).
void MessageCalendar::fit(const std::vector<std::uint32_t>& all) {
  heads_.clear();
  current_ = kNever.t;
  grow_at_ = kFew;
  if (all.size() <= kFew / 2) return;
  std::vector<std::int64_t> times;
  times.reserve(all.size());
  for (const std::uint32_t place : all) times.push_back(pool_[place].time.t);
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  const std::int64_t earliest = *std::min_element(times.begin(), middle + 1);
  // The earlier half, for messages far ahead would make the buckets too wide.
  const std::uint64_t span =
      static_cast<std::uint64_t>(*middle) - static_cast<std::uint64_t>(earliest);
  shift_ = static_cast<int>(std::bit_width(2 * span / times.size()));
  heads_.assign(2 * std::bit_ceil(all.size()), kNone);
  mask_ = heads_.size() - 1;
  grow_at_ = heads_.size();
  current_ = earliest >> shift_;
}

}  // namespace soda::kernel
