// Checkpoints by copying: mark, rewind and forget for an LP whose state is one copyable value.
#pragma once

#include <algorithm>
#include <cstddef>

#include "kernel/invariant.hpp"
#include "kernel/sliding_vector.hpp"
#include "kernel/virtual_time.hpp"

namespace soda::kernel {

// An LP holds one beside its state and forwards the three calls, at every time or only at those
// that are to be its restart points (the first mark must be forwarded).
template <class State>
class CopyHistory {
 public:
  void mark(VirtualTime now, const State& state) {
    if (!saved_.empty() && saved_.back().time == now) return;
    SODA_ASSERT(saved_.empty() || saved_.back().time < now, "mark at ", now, " after ",
                saved_.back().time);
    // Nothing has been executed before the first mark: it holds from the beginning of time.
    saved_.emplace_back(saved_.empty() ? kBeginning : now, state);
  }

  VirtualTime rewind(VirtualTime to, State& state) {
    const std::size_t kept = saved_until(to);
    SODA_ASSERT(kept > 0, "rewind to ", to, ", which has been forgotten");
    saved_.truncate(kept);
    state = saved_.back().state;
    return saved_.back().time;
  }

  // As LogicalProcess::rewind_before. Only for an LP that forwards every mark: what lies between
  // `to` and `undone` then has one and the same state.
  VirtualTime rewind_before(VirtualTime undone, VirtualTime to, State& state) {
    const std::size_t before = saved_until(to);
    const bool has_to = before > 0 && saved_[before - 1].time == to;
    if (has_to || before == saved_.size() || saved_[before].time > undone) return rewind(to, state);
    saved_.truncate(before + 1);
    saved_.back().time = to;
    state = saved_.back().state;
    return to;
  }

  VirtualTime forget(VirtualTime horizon) {
    // Step by step: what is passed is dropped.
    const Saved* saved = saved_.begin();
    while (saved != saved_.end() && saved->time <= horizon) ++saved;
    if (saved == saved_.begin()) return kBeginning;
    saved_.drop_front(static_cast<std::size_t>(saved - saved_.begin()) - 1);
    return saved_.front().time;
  }

  std::size_t size() const { return saved_.size(); }

 private:
  struct Saved {
    VirtualTime time;
    State state;

    Saved(VirtualTime time_, const State& state_) : time(time_), state(state_) {}
  };

  // How many saved states have a time <= `time`.
  std::size_t saved_until(VirtualTime time) const {
    const Saved* const end =
        std::upper_bound(saved_.begin(), saved_.end(), time,
                         [](VirtualTime t, const Saved& saved) { return t < saved.time; });
    return static_cast<std::size_t>(end - saved_.begin());
  }

  SlidingVector<Saved> saved_;
};

// For an LP that forwards every mark, and so can restart at any time: the state that a time needs
// is the one before the first execution that is not earlier. It keeps nothing before the horizon:
// what an LP has executed is gone as soon as GVT has passed it. Often that is all but the latest,
// so one saved state lies in the LP itself.
template <class State>
class StepHistory {
 public:
  void mark(VirtualTime now, const State& state) {
    if (!has_first_) {
      first_ = {now, state};
      has_first_ = true;
      return;
    }
    const VirtualTime last = later_.empty() ? first_.time : later_.back().time;
    SODA_ASSERT(last <= now, "mark at ", now, " after ", last);
    if (last < now) later_.push_back({now, state});
  }

  // Returns `to`.
  VirtualTime rewind(VirtualTime to, State& state) {
    SODA_ASSERT(to >= horizon_, "rewind to ", to, ", which has been forgotten");
    if (!has_first_) return to;
    std::size_t at = later_.size();
    while (at > 0 && later_[at - 1].time >= to) --at;
    if (at == 0 && first_.time >= to) {
      later_.truncate(0);
      first_.time = to;
      state = first_.state;
    } else if (at < later_.size()) {
      later_.truncate(at + 1);
      later_.back().time = to;
      state = later_.back().state;
    }
    return to;
  }

  VirtualTime forget(VirtualTime horizon) {
    horizon_ = horizon;
    if (!has_first_ || first_.time >= horizon) return horizon;
    std::size_t dropped = 0;
    while (dropped < later_.size() && later_[dropped].time < horizon) ++dropped;
    has_first_ = dropped < later_.size();
    if (has_first_) first_ = later_[dropped++];
    if (dropped > 0) later_.drop_front(dropped);
    return horizon;
  }

  std::size_t size() const { return (has_first_ ? 1 : 0) + later_.size(); }

 private:
  struct Saved {
    VirtualTime time;
    State state;
  };

  bool has_first_ = false;
  Saved first_{};
  SlidingVector<Saved> later_;  // ascending
  VirtualTime horizon_ = kBeginning;
};

}  // namespace soda::kernel
