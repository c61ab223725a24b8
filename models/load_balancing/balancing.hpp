// Load balancing while a run goes on: gathers samples, decides, and tells the worlds.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "kernel/api/external_source.hpp"
#include "models/load_balancing/load_balancer.hpp"
#include "models/options/run_options.hpp"

namespace soda::models {

// Tells a world which cells change hands at the beginning of `step`; without its destination.
kernel::Message transfer_message(std::int64_t step, std::span<const CellTransfer> transfers);

// Lives at the root. A decision is made from what all worlds have committed, at a GVT of step g; it
// holds from step g + buffer + 1 on, which no world has begun, so nothing is rolled back for it.
// From a step at most one holds.
class Balancing final : public kernel::ExternalSource, public LoadSink {
 public:
  // `map`: of `first_step`, before which the run begins; it ends after `steps`. `processor_of`: of
  // each world.
  Balancing(const BalancingOptions& options, std::shared_ptr<const TerritoryMap> map,
            std::vector<std::uint32_t> processor_of, std::int64_t buffer, std::int64_t first_step,
            std::int64_t steps);

  // What worlds have to sample for it.
  LoadSampling sampling() const;

  void add(LoadSample sample) override;
  // Never holds anybody up: GVT cannot come so far before it is told of again.
  kernel::VirtualTime floor() override;
  void take(kernel::VirtualTime gvt, kernel::VirtualTime earliest,
            std::vector<kernel::Message>& out) override;

  // When GVT has passed the beginning of `step`: its transfers. From any thread.
  std::vector<TerritoryChange> changes_at(std::int64_t step);
  // All transfers, in order of steps; after the run.
  const std::vector<TerritoryChange>& changes() const { return changes_; }

 private:
  std::vector<LoadSample> newest_samples();
  std::vector<CellTransfer> decide(std::int64_t step);
  void announce(std::int64_t step, std::span<const CellTransfer> transfers,
                std::vector<kernel::Message>& out);

  const BalancingOptions options_;
  const std::vector<std::uint32_t> processor_of_;
  const std::int64_t delay_;
  const std::int64_t steps_;
  std::shared_ptr<const TerritoryMap> map_;  // with all that has been decided
  kernel::SplitMix64 random_;
  std::int64_t holds_from_;
  std::int64_t next_decision_;
  std::int64_t announced_ = -1;  // the step from which the last one holds

  std::mutex mutex_;                                         // of what follows
  std::map<std::int64_t, std::vector<LoadSample>> samples_;  // by step
  std::vector<TerritoryChange> changes_;
};

}  // namespace soda::models
