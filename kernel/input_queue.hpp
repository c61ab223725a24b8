// The inputs of one LP under Time Warp: message registers, executed and pending.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "kernel/logical_process.hpp"
#include "kernel/message.hpp"
#include "kernel/sliding_vector.hpp"
#include "kernel/virtual_time.hpp"

namespace soda::kernel {

// Registers earlier than the boundary have been executed; a rollback moves the boundary back. Bags
// are runs of equal time. One sorted array holds references of 16 bytes to the messages, executed
// ones first; the messages themselves stay where they were put. Of many pending ones only the
// earliest are sorted so, the others wait in a tree: insertion is O(log n).
class InputQueue {
 public:
  // Puts a message into its register unless a newer incarnation is there already. True if that
  // changes what a bag holds.
  bool write(Message&& message);

  // Where executed and pending registers meet: just after the time last passed, or what undo() was
  // called with last.
  VirtualTime boundary() const { return boundary_; }

  // The earliest pending register that holds a message; kNever if none does.
  VirtualTime next_time() const {
    if (passed_ == near_.size()) return kNever;
    if (!near_[passed_].anti) return near_[passed_].time();
    return next_time_beyond_antis();
  }

  // The bag of `now`, which is not later than next_time(). Views are valid until the next change.
  void gather(VirtualTime now, std::vector<MessageView>& bag) const;

  // The bag of a time before the boundary.
  void gather_passed(VirtualTime time, std::vector<MessageView>& bag) const;

  // Moves the boundary to just after `now`.
  void pass(VirtualTime now);

  // Moves the boundary to `to`, over what lies before it.
  void pass_to(VirtualTime to);

  // Moves the boundary back to `from`.
  void undo(VirtualTime from);

  // Drops executed registers earlier than `kept`, and empty ones earlier than `gvt`: these have
  // nothing left to annihilate, for an older incarnation still on its way would hold GVT back.
  void forget(VirtualTime kept, VirtualTime gvt);

  // Hints that the next bag will be gathered soon.
  void prefetch() const {
    if (passed_ < near_.size()) __builtin_prefetch(&store_[near_[passed_].place]);
  }

  // Whether there are empty registers, which forget() has to look for.
  bool has_antis() const { return antis_ > 0; }

  std::size_t size() const { return near_.size() + (far_ ? far_->size() : 0); }

 private:
  static constexpr std::uint32_t kNone = (1u << 31) - 1;
  static constexpr std::size_t kMostNear = 64;

  struct Entry {
    std::int64_t t = 0;
    std::uint32_t round = 0;
    std::uint32_t place : 31 = 0;  // in store_
    bool anti : 1 = false;

    VirtualTime time() const { return {t, round}; }
  };
  static_assert(sizeof(Entry) == 16);
  using Key = std::tuple<VirtualTime, LpId, std::uint32_t, std::uint32_t>;  // register_key()
  using Far = std::map<Key, Entry>;

  // < 0, 0, > 0: the register of `entry` comes before, is, comes after that of `message`.
  int compare(const Entry& entry, const Message& message) const {
    if (entry.t != message.time.t) return entry.t < message.time.t ? -1 : 1;
    if (entry.round != message.time.round) return entry.round < message.time.round ? -1 : 1;
    return compare_rest(store_[entry.place], message);
  }
  static int compare_rest(const Message& a, const Message& b);

  static MessageView view(const Message& input) {
    return {input.source, input.kind, input.slot, input.payload.bytes()};
  }
  void gather_far(VirtualTime now, std::vector<MessageView>& bag) const;
  bool has_far() const { return far_ && !far_->empty(); }
  bool write_near(Message&& message);
  bool write_far(Message&& message);
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
  std::uint32_t antis_ = 0;    // empty registers
  VirtualTime boundary_ = kBeginning;
  std::vector<Message> store_;
  std::uint32_t free_ = kNone;  // first unused place of store_; the next one is in its `kind`
  std::unique_ptr<Far> far_;    // all later than near_; empty if nothing pending is there
};

inline bool InputQueue::write(Message&& message) {
  if (message.time < boundary_) return write_executed(std::move(message));
  if (has_far() && compare(near_.back(), message) < 0) return write_far(std::move(message));
  return write_near(std::move(message));
}

// An anti-message without its message is kept, too: the older incarnation may still be on its way.
inline bool InputQueue::write_near(Message&& message) {
  std::size_t at = near_.size();
  int order = -1;
  while (at > passed_ && (order = compare(near_[at - 1], message)) > 0) --at;
  if (at > passed_ && order == 0) return replace(near_[at - 1], std::move(message));
  const bool changes = !message.anti;
  near_.insert(at, store(std::move(message)));
  if (near_.size() > passed_ + kMostNear) spill();
  return changes;
}

inline void InputQueue::gather(VirtualTime now, std::vector<MessageView>& bag) const {
  bag.clear();
  for (std::size_t i = passed_; i < near_.size(); ++i) {
    const Entry& entry = near_[i];
    if (entry.time() > now) return;
    if (!entry.anti) bag.push_back(view(store_[entry.place]));
  }
  if (has_far()) gather_far(now, bag);
}

inline void InputQueue::pass(VirtualTime now) {
  while (passed_ < near_.size() && near_[passed_].time() <= now) {
    ++passed_;
    if (passed_ == near_.size() && has_far()) refill();
  }
  boundary_ = {now.t, now.round + 1};
}

inline InputQueue::Entry InputQueue::store(Message&& message) {
  antis_ += message.anti;
  Entry entry{message.time.t, message.time.round, free_, message.anti};
  if (free_ == kNone) {
    entry.place = static_cast<std::uint32_t>(store_.size()) & kNone;
    store_.push_back(std::move(message));
  } else {
    free_ = store_[free_].kind;
    store_[entry.place] = std::move(message);
  }
  return entry;
}

inline void InputQueue::release(const Entry& entry) {
  antis_ -= entry.anti;
  store_[entry.place].payload.clear();
  store_[entry.place].kind = free_;
  free_ = entry.place;
}

inline void InputQueue::forget(VirtualTime kept, VirtualTime gvt) {
  std::uint32_t count = 0;
  for (; count < passed_ && near_[count].time() < kept; ++count) release(near_[count]);
  near_.drop_front(count);
  passed_ -= count;
  if (antis_ > 0) drop_antis(gvt);
}

}  // namespace soda::kernel
