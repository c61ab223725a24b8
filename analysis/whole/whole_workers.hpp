// Processes that share the seeds of a search among them.
#pragma once

#include <functional>

#include "analysis/byte_codec.hpp"
#include "analysis/seed_range.hpp"

namespace soda::analysis {

struct WorkerLimits {
  unsigned jobs = 1;
  double budget_s = 0.0;  // no seed is begun after this; 0: no limit
  unsigned most_failures = 1;
};

// What a worker did with a seed, in bytes of its own choice.
struct SeedReport {
  bool failed = false;
  ByteBuffer bytes;
};

// Calls `work` for each seed in one of `jobs` forked processes, each with an empty folder that is
// removed at the end, and hands what it gives to `take` in this process, in any order. Stops at the
// limits. True: not all seeds were begun, as the time was over. Throws CheckFailed if a worker
// died.
bool share_seeds(
    const SeedRange& seeds, const WorkerLimits& limits,
    const std::function<SeedReport(std::uint64_t seed, const std::string& folder)>& work,
    const std::function<void(std::uint64_t seed, const ByteBuffer& bytes)>& take);

}  // namespace soda::analysis
