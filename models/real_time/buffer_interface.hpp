// A renderer's view of a running simulation: the states of all bodies at a clock.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "kernel/api/external_source.hpp"
#include "models/commit/commit.hpp"
#include "models/options/entry_observer.hpp"

namespace soda::models {

// In steps.
struct Lead {
  std::int64_t steps = 1;  // >= 1; at least the most steps between two frames
  std::int64_t frame = 0;  // the steps of a frame; 0: the lead stays as it is
  std::int64_t most = 1;   // if it adapts
};

// All bodies of one step. Final: no rollback can change it any more.
struct Frame {
  std::int64_t clock = 0;            // steps, from 0
  std::vector<physics::BodyId> ids;  // ascending
  std::vector<physics::BodyState> states;
};

// Between the worlds and a renderer in another thread. A frame is served when GVT has passed it, so
// what may still change is neither shown nor deleted. That costs no frame, because GVT is not held
// back by what worlds have in store but by what was shown: it may go `lead` steps beyond. So worlds
// run ahead into their buffers by as many entries as these have, and what a user does takes effect
// at most `lead` steps after what is on the screen.
//
// A lead that is shorter than a GVT round takes makes frames late though they are in store. So a
// lead may adapt. GVT should be behind by half of it at most, so that a step may get twice as dear:
// else the lead doubles, if there is more in store, and then not again until GVT can have followed.
// It shrinks by a frame when that would have done for a second.
//
// The floor of the external source, for an executor with Time Warp; one that has none runs no
// further than `lead` itself, which is the size of its buffer then.
class BufferInterface final : public kernel::ExternalSource, public EntryObserver {
 public:
  // `initial[i]` is the state of BodyId{i} at clock `first`, which is shown first.
  BufferInterface(std::span<const physics::BodyState> initial, std::uint32_t worlds,
                  const Lead& lead, std::int64_t first = 0);

  // For CommitObserver::on_step, with states; in order of steps.
  void add(const CommittedStep& step);
  void on_newest(WorldId world, std::int64_t step) override;
  kernel::VirtualTime floor() override;
  void take(kernel::VirtualTime, kernel::VirtualTime, std::vector<kernel::Message>&) override {}

  // The frame of `clock`, or of the largest one before it that is final; frame->clock says which.
  // What lies before it is freed: clocks asked for must not descend.
  std::shared_ptr<const Frame> show(std::int64_t clock);

  // The lead now, and the largest that it has been.
  std::int64_t lead_steps() const { return lead_steps_.load(); }
  std::int64_t most_lead_steps() const { return most_lead_steps_; }
  std::int64_t shown() const { return shown_.load(); }  // the clock shown last
  // The largest clock that all worlds have, final or not: what is in store.
  std::int64_t reached() const;

 private:
  void adapt_lead(std::int64_t final_beyond);

  const Lead lead_;
  const std::int64_t first_;
  std::atomic<std::int64_t> lead_steps_;
  // The renderer's.
  std::int64_t most_lead_steps_;
  std::int64_t patience_ = 0;                      // frames until the lead may grow again
  int plenty_ = 0;                                 // frames in a row that would have done with less
  std::vector<std::atomic<std::int64_t>> newest_;  // entry of each world
  std::atomic<std::int64_t> shown_;
  std::mutex mutex_;
  std::deque<std::shared_ptr<const Frame>> frames_;  // final ones; the first is the one shown
};

}  // namespace soda::models
