#include "models/transform_buffer/transform_buffer.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace soda::models {
namespace {

void require(bool condition, const char* rule, std::int64_t step, std::int64_t oldest,
             std::int64_t newest) {
  if (condition) return;
  std::fprintf(stderr, "soda: transform buffer: %s (step %lld, entries %lld .. %lld)\n", rule,
               static_cast<long long>(step), static_cast<long long>(oldest),
               static_cast<long long>(newest));
  std::abort();
}

}  // namespace

TransformBuffer::TransformBuffer(std::size_t capacity, BufferEntry initial)
    : ring_(capacity),
      open_(std::move(initial)),
      oldest_(open_.step),
      newest_(open_.step),
      newest_stale_(open_.step) {
  require(capacity >= 2, "needs room for two entries", open_.step, oldest_, newest_);
}

StoredEntry& TransformBuffer::slot(std::int64_t step) {
  return ring_[static_cast<std::size_t>(step) % ring_.size()];
}

const StoredEntry& TransformBuffer::slot(std::int64_t step) const {
  return ring_[static_cast<std::size_t>(step) % ring_.size()];
}

void TransformBuffer::require_held(std::int64_t step) const {
  const bool has_it = holds(step) && (is_open(step) || slot(step).step == step);
  require(has_it, "entry is not held", step, oldest_, newest_);
}

const Rules& TransformBuffer::rules(std::int64_t step) const {
  require_held(step);
  return is_open(step) ? open_.rules : rules_of(slot(step));
}

const Dependencies& TransformBuffer::dependencies(std::int64_t step) const {
  require_held(step);
  return is_open(step) ? open_.dependencies : slot(step).dependencies.items().front();
}

const ForeignView& TransformBuffer::view(std::int64_t step) const {
  require_held(step);
  return is_open(step) ? open_.view : view_of(slot(step));
}

bool TransformBuffer::may_leave(std::int64_t step) const {
  require_held(step);
  return is_open(step) ? open_.may_leave : slot(step).may_leave;
}

std::vector<physics::BodyId>& TransformBuffer::differs(std::int64_t step) {
  require_held(step);
  return is_open(step) ? open_.differs : slot(step).differs;
}

void TransformBuffer::take_bodies(std::vector<physics::BodyId>& ids,
                                  std::vector<physics::BodyState>& states) {
  require(open_held_, "entry is not open", newest_, oldest_, newest_);
  std::swap(ids, open_.ids);
  std::swap(states, open_.states);
  bodies_held_ = false;
}

void TransformBuffer::copy_bodies(std::int64_t step, std::vector<physics::BodyId>& ids,
                                  std::vector<physics::BodyState>& states,
                                  WorldCounters& counters) {
  require_held(step);
  if (step == newest_ && bodies_held_) {
    store_open(counters);
    std::swap(ids, open_.ids);
    std::swap(states, open_.states);
    bodies_held_ = false;
  } else {
    load_bodies(slot(step), ids, states);
  }
}

const BufferEntry& TransformBuffer::read(std::int64_t step, bool with_states,
                                         BufferEntry& copy) const {
  require_held(step);
  if (is_open(step)) return open_;
  const StoredEntry& stored = slot(step);
  copy.step = stored.step;
  copy.rules = rules_of(stored);
  copy.solves = stored.solves;
  copy.spent_ns = stored.spent_ns;
  copy.ids.clear();
  copy.states.clear();
  if (with_states) load_bodies(stored, copy.ids, copy.states);
  copy.islands.clear();
  stored.islands.for_each(
      [&copy](const physics::IslandReport& report) { copy.islands.push_back(report); });
  return copy;
}

BufferEntry TransformBuffer::release_newest() {
  if (is_open(newest_)) return std::move(open_);
  BufferEntry copy;
  read(newest_, true, copy);
  return copy;
}

const BufferEntry* TransformBuffer::open(std::int64_t step) const {
  require_held(step);
  return is_open(step) ? &open_ : nullptr;
}

const StoredEntry* TransformBuffer::stored(std::int64_t step) const {
  require_held(step);
  return is_open(step) ? nullptr : &slot(step);
}

void TransformBuffer::replace_ghosts(std::int64_t step, std::vector<Ghost> ghosts) {
  require_held(step);
  if (is_open(step))
    open_.memo.ghosts = std::move(ghosts);
  else
    models::replace_ghosts(memory_, slot(step), ghosts);
}

void TransformBuffer::add_sent(std::int64_t step, std::span<const StepMemo::SentWay> ways) {
  require_held(step);
  std::vector<StepMemo::SentWay>& sent = is_open(step) ? open_.memo.sent : slot(step).sent;
  sent.insert(sent.end(), ways.begin(), ways.end());
}

void TransformBuffer::replace_received(std::int64_t step, ReceivedGhosts received) {
  require_held(step);
  if (is_open(step)) {
    open_.view.received = std::move(received);
    return;
  }
  std::unique_ptr<ForeignView>& view = slot(step).view;
  if (view == nullptr) view = std::make_unique<ForeignView>();
  view->received = std::move(received);
}

const StoredEntry* TransformBuffer::stale_next() const {
  return newest_ < newest_stale_ ? &slot(newest_ + 1) : nullptr;
}

// The slot still has the stale version of the entry, if there is one.
void TransformBuffer::store_open(WorldCounters& counters) {
  if (!open_held_) return;
  const StoredEntry none;
  const bool has_older = newest_ > oldest_;
  StoredEntry& replaced = slot(newest_);
  StoredEntry stored = store(memory_, open_, has_older ? slot(newest_ - 1) : none,
                             replaced.step == newest_ ? replaced : none, counters);
  replaced = std::move(stored);
  open_held_ = false;
}

BufferEntry& TransformBuffer::append() {
  require(newest_ - oldest_ + 1 < static_cast<std::int64_t>(ring_.size()), "is full", newest_ + 1,
          oldest_, newest_);
  open_.step = ++newest_;
  open_held_ = true;
  bodies_held_ = true;
  return open_;
}

void TransformBuffer::truncate(std::int64_t step, WorldCounters& counters) {
  require_held(step);
  if (step == newest_) return;
  store_open(counters);
  newest_stale_ = std::max(newest_stale_, newest_);
  newest_is(step);
}

void TransformBuffer::newest_is(std::int64_t step) {
  newest_ = step;
  bodies_held_ = false;
}

void TransformBuffer::put_back(std::int64_t step, WorldCounters& counters) {
  while (newest_ < std::min(step, newest_stale_)) {
    if (!newest_is_as_before()) return;
    store_open(counters);
    newest_is(newest_ + 1);
  }
}

bool& TransformBuffer::frame_differs(std::int64_t step) {
  require_held(step);
  return is_open(step) ? open_.frame_differs : slot(step).frame_differs;
}

void TransformBuffer::forget(std::int64_t step) {
  for (; oldest_ < std::min(step, newest_); ++oldest_) slot(oldest_) = {};
}

}  // namespace soda::models
