// A renderer in a run on the virtual cluster: it shows frames by the virtual clock.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kernel/api/partition.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "models/cost/artificial_load.hpp"
#include "models/real_time/playback.hpp"

namespace soda::models {

// The same playback as by the wall clock (play()), and the same loads; reproducible to the bit.
// Connected as RunOptions::cluster.clock_user, entries and event_cost_ns.
class VirtualPlayback final : public kernel::ClockUser, public EntryObserver {
 public:
  // Frames begin when `fill` steps are in store, or all. `step_ns`: what a load of 1 adds to a step
  // of a world.
  VirtualPlayback(BufferInterface& buffer, const PlaybackOptions& options, std::int64_t fill,
                  const ArtificialLoad& load, const kernel::Partition& processors, double step_ns);

  void set_now(std::int64_t now_ns) override { now_ns_ = now_ns; }
  std::optional<std::int64_t> next_ns() override;
  void act() override;
  void on_newest(WorldId world, std::int64_t step) override;
  // Of the event that the world executed last, which costs `own_ns` without load: with that of the
  // entry that it has written, rounded down: a step that takes just as long as it has is not late.
  std::int64_t event_cost_ns(WorldId world, std::int64_t own_ns);

  // After the run: shows what is left.
  void finish();
  const std::vector<ShownFrame>& frames() const { return playback_->frames(); }
  // Of each processor.
  const std::vector<std::vector<WorkMark>>& work() const { return work_; }

 private:
  struct OfWorld {
    std::int64_t newest = 0;    // entry
    std::int64_t ready_ns = 0;  // when its event has been paid for
    std::int64_t load_ns = 0;   // of the event that is paid for next,
    bool has_written = false;   // if that wrote an entry
  };

  void tell_what_is_ready();
  double since_s() const;

  BufferInterface& buffer_;
  const PlaybackOptions options_;
  const std::int64_t enough_;
  const ArtificialLoad load_;
  const kernel::Partition processors_;
  const double step_ns_;
  std::vector<OfWorld> worlds_;
  std::vector<std::vector<WorkMark>> work_;
  std::vector<std::int64_t> worked_ns_;  // of each processor
  std::int64_t now_ns_ = 0;
  std::int64_t first_frame_ns_ = 0;
  std::optional<Playback> playback_;
};

}  // namespace soda::models
