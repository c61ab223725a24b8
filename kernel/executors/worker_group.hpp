// The workers of one process: what they share, and running them.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/api/partition.hpp"
#include "kernel/executors/rank_link.hpp"
#include "kernel/gvt/gvt.hpp"
#include "kernel/queues/inbox.hpp"

namespace soda::kernel {

struct WorkerGroup {
  // `workers` of the partition's, from `first_worker` on, live here; `link` leads to the others,
  // and is null if there are none.
  WorkerGroup(const Partition& all, std::size_t first_worker_, std::size_t workers, RankLink* link_)
      : partition(all),
        first_worker(first_worker_),
        inboxes(workers),
        rounds(static_cast<unsigned>(workers), static_cast<unsigned>(all.workers)),
        link(link_) {}

  // Of a worker of all ranks; each rank has as many.
  std::uint32_t rank_of(std::size_t worker) const {
    return static_cast<std::uint32_t>(worker / inboxes.size());
  }

  const Partition partition;       // of all LPs over the workers of all ranks
  const std::size_t first_worker;  // of this rank
  std::vector<Inbox> inboxes;      // of each worker of this rank
  GvtRounds rounds;
  RankLink* const link;
  // Whether GVT waits for an ExternalSource, so that more rounds would not help; a hint, as the
  // next one.
  std::atomic<bool> held_externally{false};
  std::atomic<std::size_t> idle{0};  // how many workers sleep; a hint, never a reason to end
};

// Drives the LPs of the worker group's workers to the end; worker 0 is the calling thread. The sums
// are those of this worker group. Throws what left a handler, and ThreadsNotStarted.
RunResult run_worker_group(WorkerGroup& group, std::span<const std::unique_ptr<LogicalProcess>> lps,
                           VirtualTime end, const ThreadsOptions& options,
                           const ProgressFn& progress);

}  // namespace soda::kernel
