// CPU time that is added to the steps of a run, to see what buffers do about it.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "kernel/api/partition.hpp"
#include "models/cost/artificial_load.hpp"
#include "models/options/entry_observer.hpp"

namespace soda::analysis {

// Spends CPU time before an entry counts as written. Over ranks each has one for its own worlds:
// that of the root hears how far the worlds of others are, and tells them when frames begin.
class StepLoad final : public models::EntryObserver {
 public:
  // Who is told what this one is, at the root of all worlds; and the step that the run begins at.
  struct Next {
    models::EntryObserver& observer;
    std::int64_t first_step = 0;
  };

  // A load of 1 adds `share_s` to a step of a world. `workers` of all ranks.
  StepLoad(const models::ArtificialLoad& load, double share_s, const kernel::Partition& workers,
           const Next& next, bool is_root);

  void on_newest(models::WorldId world, std::int64_t step) override;
  std::vector<kernel::Bytes> take_news() override;
  void receive(std::span<const std::byte> news) override;

  // Peaks count from now on. From any thread.
  void first_frame_follows();
  // Of each worker; at the root of those of all ranks, each by its own clocks.
  std::vector<std::vector<models::WorkMark>> take_work() { return std::move(work_); }

 private:
  double since_s() const;
  void tell(models::WorldId world, std::int64_t step, const models::WorkMark* mark);

  const models::ArtificialLoad load_;
  const double share_s_;
  const kernel::Partition workers_;
  models::EntryObserver& next_;
  const bool is_root_;
  // Of each world, and of each worker: touched by the thread that executes it, or that hears of it.
  std::vector<std::int64_t> last_;
  std::vector<std::vector<models::WorkMark>> work_;
  std::atomic<std::int64_t> first_frame_ns_{0};

  bool has_sent_begin_ = false;
  std::mutex mutex_;
  kernel::Bytes news_;  // since the last take_news()
};

}  // namespace soda::analysis
