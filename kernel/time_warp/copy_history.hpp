// Checkpoints by copying, for an LP whose state is one copyable value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <type_traits>

#include "kernel/api/invariant.hpp"
#include "kernel/api/logical_process.hpp"
#include "kernel/api/virtual_time.hpp"
#include "kernel/queues/sliding_vector.hpp"

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

// Base of an LP whose whole state is one small value that may be copied byte by byte: the executor
// does it (LogicalProcess::state_bytes), and the LP needs no history.
template <class State>
class SmallProcess : public LogicalProcess {
 public:
  static_assert(std::is_trivially_copyable_v<State> && sizeof(State) % 8 == 0);

  std::span<std::byte> state_bytes() final { return std::as_writable_bytes(std::span(&state_, 1)); }
  void mark(VirtualTime now) final { refuse("mark", now); }
  VirtualTime rewind(VirtualTime to) final { return refuse("rewind", to); }
  VirtualTime forget(VirtualTime horizon) final { return refuse("forget", horizon); }

 protected:
  State state_{};

 private:
  static VirtualTime refuse(const char* call, VirtualTime time) {
    SODA_ASSERT(false, call, '(', time, ") of an LP whose state the executor saves");
    return time;
  }
};

}  // namespace soda::kernel
