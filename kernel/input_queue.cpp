#include "kernel/input_queue.hpp"

#include <algorithm>

#include "kernel/invariant.hpp"

namespace soda::kernel {

int InputQueue::compare_rest(const Message& a, const Message& b) {
  const auto order = std::tie(a.source, a.kind, a.slot) <=> std::tie(b.source, b.kind, b.slot);
  return order < 0 ? -1 : order > 0;
}

// An anti-message without its message is kept, too: the older incarnation may still be on its way.
bool InputQueue::write_near(Message&& message) {
  std::size_t at = near_.size();
  int order = -1;
  while (at > 0 && (order = compare(near_[at - 1], message)) < 0) --at;
  if (at > 0 && order == 0) return replace(near_[at - 1], std::move(message));
  const bool changes = !message.anti;
  near_.insert(near_.begin() + static_cast<std::ptrdiff_t>(at), store(std::move(message)));
  if (near_.size() > kMostNear) spill();
  return changes;
}

bool InputQueue::write_far(Message&& message) {
  const auto [found, is_new] = far_.try_emplace(register_key(message));
  if (!is_new) return replace(found->second, std::move(message));
  const bool changes = !message.anti;
  found->second = store(std::move(message));
  return changes;
}

bool InputQueue::write_executed(Message&& message) {
  Entry* const at = std::lower_bound(
      executed_.begin(), executed_.end(), message,
      [this](const Entry& entry, const Message& m) { return compare(entry, m) < 0; });
  if (at != executed_.end() && compare(*at, message) == 0) return replace(*at, std::move(message));
  const bool changes = !message.anti;
  const auto index = static_cast<std::size_t>(at - executed_.begin());
  executed_.insert(index, store(std::move(message)));
  return changes;
}

bool InputQueue::replace(Entry& entry, Message&& message) {
  Message& old = store_[entry.place];
  if (message.incarnation < old.incarnation) return false;
  SODA_ASSERT(message.incarnation != old.incarnation, "incarnation ", message.incarnation,
              " of LP ", index_of(message.source), " to LP ", index_of(message.destination), " at ",
              message.time, " delivered twice");
  const bool changes = message.anti != old.anti || message.payload != old.payload;
  antis_ += message.anti;
  antis_ -= old.anti;
  entry.anti = message.anti;
  old = std::move(message);
  return changes;
}

VirtualTime InputQueue::next_time_beyond_antis() const {
  for (std::size_t i = near_.size(); i > 0; --i)
    if (!near_[i - 1].anti) return near_[i - 1].time();
  for (const auto& [key, entry] : far_)
    if (!entry.anti) return entry.time();
  return kNever;
}

// What is undone is earlier than what is pending.
void InputQueue::undo(VirtualTime from) {
  std::size_t standing = executed_.size();
  for (; standing > 0 && executed_[standing - 1].time() >= from; --standing)
    near_.push_back(executed_[standing - 1]);
  executed_.truncate(standing);
  boundary_ = from;
}

void InputQueue::forget(VirtualTime kept, VirtualTime gvt) {
  std::size_t count = 0;
  for (; count < executed_.size() && executed_[count].time() < kept; ++count)
    release(executed_[count]);
  executed_.drop_front(count);
  if (antis_ > 0) drop_antis(gvt);
}

void InputQueue::drop_antis(VirtualTime gvt) {
  const auto drop = [&](const Entry& entry) {
    if (!entry.anti || entry.time() >= gvt) return false;
    release(entry);
    return true;
  };
  Entry* const kept = std::remove_if(executed_.begin(), executed_.end(), drop);
  executed_.truncate(static_cast<std::size_t>(kept - executed_.begin()));
  std::erase_if(near_, drop);
  if (near_.empty() && !far_.empty()) refill();
}

void InputQueue::spill() {
  const std::size_t moved = near_.size() - kMostNear / 2;
  for (std::size_t i = 0; i < moved; ++i)
    far_.emplace_hint(far_.begin(), register_key(store_[near_[i].place]), near_[i]);
  near_.erase(near_.begin(), near_.begin() + static_cast<std::ptrdiff_t>(moved));
}

void InputQueue::refill() {
  while (near_.size() < kMostNear / 2 && !far_.empty()) {
    near_.push_back(far_.begin()->second);
    far_.erase(far_.begin());
  }
  std::reverse(near_.begin(), near_.end());
}

}  // namespace soda::kernel
