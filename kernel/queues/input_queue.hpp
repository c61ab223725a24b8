// The inputs of one LP under Time Warp: messages, executed and pending.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "kernel/api/message.hpp"
#include "kernel/api/virtual_time.hpp"
#include "kernel/queues/message_pool.hpp"
#include "kernel/queues/sliding_vector.hpp"

namespace soda::kernel {

// Messages earlier than the boundary have been executed; a rollback moves the boundary back. Bags
// are runs of equal time. One sorted array holds references of 16 bytes to the messages, executed
// ones first; the messages themselves lie in a pool that the LPs of a worker share. Of many pending
// ones only the earliest are sorted so, the others wait in a tree: insertion is O(log n).
class InputQueue {
 public:
  // `pool` must outlive the queue, which leaves its messages there.
  explicit InputQueue(MessagePool& pool) : pool_(&pool) {}

  // Puts a message where its id belongs unless a newer version is there already. True if that
  // changes what a bag holds.
  bool write(Message&& message);

  // What has the id of `message`, if that has been executed; null if nothing does.
  const Message* find_executed(const Message& message) const;

  // Where executed and pending ones meet: just after the time last passed, or what undo() was
  // called with last.
  VirtualTime boundary() const { return boundary_; }

  // The time of the earliest pending message; kNever if there is none.
  VirtualTime next_time() const {
    const Entry* const next = near_.begin() + passed_;
    if (next == near_.end()) return kNever;
    if (!next->anti) return next->time();
    return next_time_beyond_antis();
  }

  // The bag of `now`, which is not later than next_time(). Views are valid until the next change.
  // Returns what pass(now) is to be told.
  std::uint32_t gather(VirtualTime now, SlidingVector<MessageView>& bag) const;

  // The bag of a time before the boundary.
  void gather_passed(VirtualTime time, SlidingVector<MessageView>& bag) const;

  // Moves the boundary to just after `now`; `passed` is what gather(now, ...) has just returned.
  void pass(VirtualTime now, std::uint32_t passed) {
    boundary_ = {now.t, now.round + 1};
    passed_ = passed;
    if (far_) [[unlikely]]
      pass_far(now);
  }

  // Moves the boundary to `to`, over what lies before it.
  void pass_to(VirtualTime to);

  // The same where nothing pending lies at or before `now`; what was executed then lies elsewhere.
  void pass_over(VirtualTime now) { boundary_ = {now.t, now.round + 1}; }

  // A message that lies in the pool, of an execution that passed over it: later than what has been
  // executed here.
  void append_executed(std::uint32_t place) {
    const VirtualTime time = (*pool_)[place].time;
    near_.insert(passed_++, {time.t, time.round, place, false});
  }

  MessagePool& pool() const { return *pool_; }

  static MessageView view(const Message& input) {
    return {input.source, input.kind, input.slot, input.payload.bytes()};
  }

  // Moves the boundary back to `from`.
  void undo(VirtualTime from);

  // Drops executed ones earlier than `kept`, and annihilated ones earlier than `gvt`: these have
  // nothing left to annihilate, for an older version still on its way would hold GVT back.
  void forget(VirtualTime kept, VirtualTime gvt);

  // Hints that the next bag will be gathered soon.
  [[gnu::always_inline]] void prefetch() const {
    if (passed_ < near_.size()) __builtin_prefetch(&(*pool_)[near_[passed_].place]);
  }

  // Whether there are annihilated messages, which forget() has to look for.
  bool has_antis() const { return antis_ > 0; }

  // The time of the first of them; there is one.
  VirtualTime first_anti() const;

  std::size_t size() const { return near_.size() + (far_ ? far_->size() : 0); }

 private:
  static constexpr std::ptrdiff_t kMostNear = 64;

  struct Entry {
    std::int64_t t = 0;
    std::uint32_t round = 0;
    std::uint32_t place : 31 = 0;  // in the pool
    bool anti : 1 = false;

    VirtualTime time() const { return {t, round}; }
  };
  static_assert(sizeof(Entry) == 16);
  using Key = std::tuple<VirtualTime, LpId, std::uint32_t, std::uint32_t>;  // message_id()
  using Far = std::map<Key, Entry>;

  // < 0, 0, > 0: the id of `entry` comes before, is, comes after that of `message`.
  int compare(const Entry& entry, const Message& message) const {
    if (entry.t != message.time.t) return entry.t < message.time.t ? -1 : 1;
    if (entry.round != message.time.round) return entry.round < message.time.round ? -1 : 1;
    return compare_rest(message_of(entry), message);
  }
  Message& message_of(const Entry& entry) const { return (*pool_)[entry.place]; }
  static int compare_rest(const Message& a, const Message& b);

  void gather_far(VirtualTime now, SlidingVector<MessageView>& bag) const;
  void pass_far(VirtualTime now);
  bool has_far() const { return far_ && !far_->empty(); }
  bool write_near(Message&& message);
  bool write_far(Message&& message);
  std::size_t place_of_executed(const Message& message) const;
  bool write_executed(Message&& message);
  bool replace(Entry& entry, Message&& message);
  VirtualTime next_time_beyond_antis() const;
  Entry store(Message&& message);
  void release(const Entry& entry);
  void spill();
  void refill();
  void drop_antis(VirtualTime gvt);

  SlidingVector<Entry> near_;  // earliest first
  std::uint32_t passed_ = 0;   // how many of these have been executed
  std::uint32_t antis_ = 0;    // annihilated messages
  VirtualTime boundary_ = kBeginning;
  MessagePool* pool_;
  std::unique_ptr<Far> far_;  // all later than near_; empty if nothing pending is there
};

inline bool InputQueue::write(Message&& message) {
  if (message.time < boundary_) return write_executed(std::move(message));
  if (has_far() && compare(near_.back(), message) < 0) return write_far(std::move(message));
  return write_near(std::move(message));
}

// An anti-message without its message is kept, too: the older version may still be on its way.
inline bool InputQueue::write_near(Message&& message) {
  Entry* const pending = near_.begin() + passed_;
  Entry* at = near_.end();
  while (at != pending && at[-1].t > message.time.t) --at;
  if (at != pending && at[-1].t == message.time.t) {
    int order = -1;
    while (at != pending && (order = compare(at[-1], message)) > 0) --at;
    if (at != pending && order == 0) return replace(at[-1], std::move(message));
  }
  const bool changes = !message.anti;
  near_.insert(static_cast<std::size_t>(at - near_.begin()), store(std::move(message)));
  if (near_.end() - near_.begin() > passed_ + kMostNear) [[unlikely]]
    spill();
  return changes;
}

inline std::uint32_t InputQueue::gather(VirtualTime now, SlidingVector<MessageView>& bag) const {
  bag.truncate(0);
  const Entry* const end = near_.end();
  const Entry* entry = near_.begin() + passed_;
  for (; entry != end && entry->time() <= now; ++entry)
    if (!entry->anti) bag.emplace_back(view(message_of(*entry)));
  if (far_ && entry == end) [[unlikely]]
    gather_far(now, bag);
  return static_cast<std::uint32_t>(entry - near_.begin());
}

inline InputQueue::Entry InputQueue::store(Message&& message) {
  const bool anti = message.anti;
  antis_ += anti;
  const VirtualTime time = message.time;
  return {time.t, time.round, pool_->put(std::move(message)), anti};
}

inline void InputQueue::release(const Entry& entry) {
  antis_ -= entry.anti;
  pool_->release(entry.place);
}

inline void InputQueue::forget(VirtualTime kept, VirtualTime gvt) {
  const Entry* entry = near_.begin();
  const Entry* const pending = entry + passed_;
  for (; entry != pending && entry->time() < kept; ++entry) release(*entry);
  const auto count = static_cast<std::size_t>(entry - near_.begin());
  near_.drop_front(count);
  passed_ -= static_cast<std::uint32_t>(count);
  if (antis_ > 0) drop_antis(gvt);
}

}  // namespace soda::kernel
