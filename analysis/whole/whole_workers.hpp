// Processes that share the seeds of a search among them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "analysis/text/byte_codec.hpp"
#include "analysis/text/seed_range.hpp"

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

// Why not all seeds were begun, if so; but for the most failures.
struct SearchEnd {
  bool out_of_time = false;
  std::uint32_t stopped = 0;  // the signal that did it (stop_signals.hpp)
};

// " (out of time)", or why it was ended early; else nothing.
std::string text_of(const SearchEnd& end);

// kExitSignal and the signal, kExitCheckFailed, or kExitOk.
int exit_code_of(const SearchEnd& end, bool failed);

// Calls `work` for each seed in one of `jobs` forked processes, each with an empty folder that is
// removed at the end, and hands what it gives to `take` in this process, in any order. Stops at the
// limits; after SIGINT or SIGTERM the seeds that were begun are finished. Throws CheckFailed if a
// worker died.
SearchEnd share_seeds(
    const SeedRange& seeds, const WorkerLimits& limits,
    const std::function<SeedReport(std::uint64_t seed, const std::string& folder)>& work,
    const std::function<void(std::uint64_t seed, const ByteBuffer& bytes)>& take);

}  // namespace soda::analysis
