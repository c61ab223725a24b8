#include "kernel/lp_schedule.hpp"

#include <algorithm>
#include <bit>

namespace soda::kernel {

// To the next bucket with an LP.
void LpSchedule::advance() {
  for (std::size_t passed = 1;; ++passed) {
    if (passed > heads_.size()) return rebuild();
    const std::uint32_t first = head_of(++current_);
    if (first == kNone) continue;
    adopt(first);
    if (!heap_.empty()) return note_work(passed);
  }
}

// Moves those of the current bucket from the list to the heap; others wait for their turn.
void LpSchedule::adopt(std::uint32_t first) {
  for (std::uint32_t lp = first; lp != kNone;) {
    Node& node = nodes_[lp];
    const std::uint32_t next = node.next;
    if (bucket_of(node.t) == current_) {
      unlink(node);
      push_heap({node.t, node.round, lp});
    } else {
      ++work_;
    }
    lp = next;
  }
}

// Buckets passed and LPs that were too many for one: where they cost more than a rebuild, the width
// does not fit any more.
void LpSchedule::note_work(std::size_t passed) {
  ++adopted_;
  work_ += passed;
  if (heap_.size() > kCrowded) work_ += heap_.size();
  if (adopted_ + work_ < 16 * heads_.size()) return;
  if (work_ > 6 * adopted_) rebuild();
  adopted_ = 0;
  work_ = 0;
}

void LpSchedule::rebuild() {
  std::vector<std::uint32_t> all;
  for (std::uint32_t lp = 0; lp < nodes_.size(); ++lp)
    if (nodes_[lp].time() != kNever) all.push_back(lp);
  heap_.clear();
  fit(all);
  listed_ = 0;
  for (const std::uint32_t lp : all) {
    nodes_[lp].is_listed = false;
    place(lp);
  }
  adopted_ = 0;
  work_ = 0;
}

// Number and width of the buckets, and the first of them. Few LPs all lie in the heap. The same
// rule as the oracle's queue, but not its code (README, decision 11).
void LpSchedule::fit(const std::vector<std::uint32_t>& all) {
  current_ = kNever.t;
  most_in_heap_ = kMostOfFew;
  if (all.size() <= kFewLps) return;
  most_in_heap_ += 4 * nodes_.size();
  std::vector<std::int64_t> times;
  times.reserve(all.size());
  for (const std::uint32_t lp : all) times.push_back(nodes_[lp].t);
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  const std::int64_t earliest = *std::min_element(times.begin(), middle + 1);
  // The earlier half, for LPs far ahead would make the buckets too wide.
  const std::uint64_t span =
      static_cast<std::uint64_t>(*middle) - static_cast<std::uint64_t>(earliest);
  shift_ = static_cast<int>(std::bit_width(2 * span / times.size()));
  heads_.assign(std::bit_ceil(all.size()), kNone);
  mask_ = heads_.size() - 1;
  most_listed_ = 2 * heads_.size();
  current_ = earliest >> shift_;
}

}  // namespace soda::kernel
