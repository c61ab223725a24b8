// Time Warp over the ranks of a job, each with worker threads of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/api/transport.hpp"

namespace soda::kernel {

// What the model of one rank tells that of another beside messages: opaque bytes, those of one rank
// in the order in which they were taken. The root's go to all others, those of others to the root.
// All that was made before the run ended arrives. Both are called by one worker while others run.
struct RecordHooks {
  // All records made since the last call; may be none.
  std::function<std::vector<Bytes>()> take;
  // A record of another rank. Needed where another takes.
  std::function<void(std::span<const std::byte>)> receive;
};

// The LPs that a rank drives: first .. last - 1.
struct LpRange {
  std::uint32_t first = 0, last = 0;
};
LpRange own_lps(const Transport& transport, unsigned threads, std::size_t lps);

// As run_threads, with options.threads workers on each of the ranks; all ranks call it with equal
// arguments. lps[i] is needed for the rank's own LPs only, others may be null. The ranks' threads
// together are the workers; GVT is asynchronous between ranks (see colour_count.hpp).
//
// The result holds the sums over all ranks and the fault at the root; elsewhere the rank's own
// counters, and a fault without its text. `progress` gets the counters of this rank. Throws
// PeerFailed if another rank failed before the run; any other exception is this rank's, and leaves
// transport.runs() true: the others wait, and the caller must end the job.
RunResult run_distributed(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const ThreadsOptions& options, Transport& transport,
                          const RecordHooks& records = {}, const ProgressFn& progress = {});

}  // namespace soda::kernel
