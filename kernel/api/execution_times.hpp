// How long the executions of a worker's LPs have taken, and whether they stand.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// Told as an EventRecorder is. Executions that were undone and not put back do not stand, nor do
// those that nobody has committed when the run ends.
class ExecutionTimes {
 public:
  void executed(LpId lp, VirtualTime time, std::int64_t took_ns);
  void rolled_back(LpId lp, VirtualTime time);
  void put_back(LpId lp, VirtualTime time);
  void committed(LpId lp, VirtualTime time);

  std::int64_t committed_ns() const { return committed_ns_; }
  std::int64_t others_ns() const { return executed_ns_ - committed_ns_; }

 private:
  struct OfLp {
    std::deque<std::pair<VirtualTime, std::int64_t>> standing;  // ascending by time
    std::map<VirtualTime, std::int64_t> undone;                 // the latest of each time
  };
  OfLp& of(LpId lp);

  std::vector<OfLp> lps_;
  std::int64_t executed_ns_ = 0, committed_ns_ = 0;
};

}  // namespace soda::kernel
