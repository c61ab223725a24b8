#include "models/transform_buffer.hpp"

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
    : ring_(capacity), oldest_(initial.step), newest_(initial.step), newest_stale_(initial.step) {
  require(capacity >= 2, "needs room for two entries", initial.step, oldest_, newest_);
  slot(initial.step) = std::move(initial);
}

BufferEntry& TransformBuffer::slot(std::int64_t step) {
  return ring_[static_cast<std::size_t>(step) % ring_.size()];
}

BufferEntry& TransformBuffer::at(std::int64_t step) {
  require(holds(step), "entry is not held", step, oldest_, newest_);
  return slot(step);
}

const BufferEntry& TransformBuffer::newest_entry() const {
  return ring_[static_cast<std::size_t>(newest_) % ring_.size()];
}

BufferEntry* TransformBuffer::stale_next() {
  return newest_ < newest_stale_ ? &slot(newest_ + 1) : nullptr;
}

BufferEntry& TransformBuffer::append() {
  require(newest_ - oldest_ + 1 < static_cast<std::int64_t>(ring_.size()), "is full", newest_ + 1,
          oldest_, newest_);
  BufferEntry& entry = slot(++newest_);
  entry.step = newest_;
  return entry;
}

void TransformBuffer::truncate(std::int64_t step) {
  require(holds(step), "entry is not held", step, oldest_, newest_);
  newest_stale_ = std::max(newest_stale_, newest_);
  newest_ = step;
}

void TransformBuffer::put_back(std::int64_t step) {
  const auto is_as_before = [this] {
    const BufferEntry& entry = slot(newest_);
    return entry.differs.empty() && !entry.frame_differs;
  };
  while (newest_ < std::min(step, newest_stale_) && is_as_before()) ++newest_;
}

void TransformBuffer::forget(std::int64_t step) { oldest_ = std::clamp(step, oldest_, newest_); }

}  // namespace soda::models
