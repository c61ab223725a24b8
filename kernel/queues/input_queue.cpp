#include "kernel/queues/input_queue.hpp"

#include <algorithm>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {

int InputQueue::compare_rest(const Message& a, const Message& b) {
  const auto order = std::tie(a.source, a.kind, a.slot) <=> std::tie(b.source, b.kind, b.slot);
  return order < 0 ? -1 : order > 0;
}

void InputQueue::gather_far(VirtualTime now, SlidingVector<MessageView>& bag) const {
  for (const auto& [key, entry] : *far_) {
    if (entry.time() > now) return;
    if (!entry.anti) bag.push_back(view(message_of(entry)));
  }
}

bool InputQueue::write_far(Message&& message) {
  const auto [found, is_new] = far_->try_emplace(message_id(message));
  if (!is_new) return replace(found->second, std::move(message));
  const bool changes = !message.anti;
  found->second = store(std::move(message));
  return changes;
}

// Where its id lies, or belongs.
std::size_t InputQueue::place_of_executed(const Message& message) const {
  const Entry* const at = std::lower_bound(
      near_.begin(), near_.begin() + passed_, message,
      [this](const Entry& entry, const Message& m) { return compare(entry, m) < 0; });
  return static_cast<std::size_t>(at - near_.begin());
}

const Message* InputQueue::find_executed(const Message& message) const {
  const std::size_t index = place_of_executed(message);
  const bool is_there = index < passed_ && compare(near_[index], message) == 0;
  return is_there && !near_[index].anti ? &message_of(near_[index]) : nullptr;
}

bool InputQueue::write_executed(Message&& message) {
  const std::size_t index = place_of_executed(message);
  if (index < passed_ && compare(near_[index], message) == 0)
    return replace(near_[index], std::move(message));
  const bool changes = !message.anti;
  near_.insert(index, store(std::move(message)));
  ++passed_;
  return changes;
}

bool InputQueue::replace(Entry& entry, Message&& message) {
  Message& old = message_of(entry);
  if (message.version < old.version) return false;
  SODA_ASSERT(message.version != old.version, "version ", message.version, " of LP ",
              index_of(message.source), " to LP ", index_of(message.destination), " at ",
              message.time, " delivered twice");
  const bool changes = message.anti != old.anti || message.payload != old.payload;
  antis_ += message.anti;
  antis_ -= old.anti;
  entry.anti = message.anti;
  old = std::move(message);
  return changes;
}

void InputQueue::gather_passed(VirtualTime time, SlidingVector<MessageView>& bag) const {
  bag.truncate(0);
  const Entry* const end = near_.begin() + passed_;
  const Entry* at = std::lower_bound(
      near_.begin(), end, time, [](const Entry& entry, VirtualTime t) { return entry.time() < t; });
  for (; at != end && at->time() == time; ++at)
    if (!at->anti) bag.push_back(view(message_of(*at)));
}

VirtualTime InputQueue::next_time_beyond_antis() const {
  for (std::size_t i = passed_; i < near_.size(); ++i)
    if (!near_[i].anti) return near_[i].time();
  if (far_)
    for (const auto& [key, entry] : *far_)
      if (!entry.anti) return entry.time();
  return kNever;
}

VirtualTime InputQueue::first_anti() const {
  for (const Entry& entry : near_)
    if (entry.anti) return entry.time();
  for (const auto& [key, entry] : *far_)
    if (entry.anti) return entry.time();
  return kNever;
}

void InputQueue::pass_far(VirtualTime now) {
  if (passed_ == near_.size()) refill();
  while (passed_ < near_.size() && near_[passed_].time() <= now) {
    ++passed_;
    if (passed_ == near_.size()) refill();
  }
}

void InputQueue::pass_to(VirtualTime to) {
  while (passed_ < near_.size() && near_[passed_].time() < to) {
    ++passed_;
    if (passed_ == near_.size() && has_far()) refill();
  }
  boundary_ = to;
}

void InputQueue::undo(VirtualTime from) {
  while (passed_ > 0 && near_[passed_ - 1].time() >= from) --passed_;
  boundary_ = from;
}

// What is pending can be earlier than `gvt`, too: an LP that has coasted back executes it again. So
// antis before `gvt` can lie in the tree.
void InputQueue::drop_antis(VirtualTime gvt) {
  const auto drop = [&](const Entry& entry) { return entry.anti && entry.time() < gvt; };
  std::uint32_t dropped_passed = 0;
  for (std::size_t i = 0; i < near_.size(); ++i) {
    if (!drop(near_[i])) continue;
    release(near_[i]);
    dropped_passed += i < passed_;
  }
  Entry* const kept = std::remove_if(near_.begin(), near_.end(), drop);
  near_.truncate(static_cast<std::size_t>(kept - near_.begin()));
  passed_ -= dropped_passed;
  if (!has_far()) return;
  for (auto at = far_->begin(); at != far_->end() && at->second.time() < gvt;) {
    if (drop(at->second)) {
      release(at->second);
      at = far_->erase(at);
    } else {
      ++at;
    }
  }
  if (passed_ == near_.size()) refill();
}

// From the near ones to the tree, until half as many are left as may be near.
void InputQueue::spill() {
  if (!far_) far_ = std::make_unique<Far>();
  const std::size_t stay = passed_ + std::size_t{kMostNear / 2};
  for (std::size_t i = near_.size(); i > stay; --i)
    far_->emplace_hint(far_->begin(), message_id(message_of(near_[i - 1])), near_[i - 1]);
  near_.truncate(stay);
}

void InputQueue::refill() {
  while (near_.size() < passed_ + std::size_t{kMostNear / 2} && !far_->empty()) {
    near_.push_back(far_->begin()->second);
    far_->erase(far_->begin());
  }
}

}  // namespace soda::kernel
