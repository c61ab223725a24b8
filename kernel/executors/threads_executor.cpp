#include <algorithm>
#include <deque>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/executors/worker.hpp"
#include "kernel/executors/worker_group.hpp"

namespace soda::kernel {
namespace {

// The first exception that left a worker.
struct FirstError {
  std::mutex mutex;
  std::exception_ptr error;
};

void stop(WorkerGroup& group) {
  group.rounds.stop_run();
  for (Inbox& inbox : group.inboxes) inbox.wake();
}

void run_worker(Worker& worker, WorkerGroup& group, FirstError& first) {
  try {
    worker.run();
  } catch (...) {
    {
      const std::lock_guard lock(first.mutex);
      if (!first.error) first.error = std::current_exception();
    }
    stop(group);
  }
}

// All but the first, which is the caller. If the system does not give as many, those that have
// started end before this throws.
std::vector<std::jthread> start_workers(std::deque<Worker>& workers, WorkerGroup& group,
                                        FirstError& first) {
  std::vector<std::jthread> threads;
  threads.reserve(workers.size());
  try {
    for (std::size_t i = 1; i < workers.size(); ++i)
      threads.emplace_back([&, i] { run_worker(workers[i], group, first); });
  } catch (const std::system_error& error) {
    const std::size_t started = threads.size() + 1;
    stop(group);
    threads.clear();
    throw ThreadsNotStarted(describe(
        "of ", workers.size(), " worker threads only ", started, " could be started: ",
        error.code().message(), "; ask for fewer or raise the limit of this user or container"));
  }
  return threads;
}

}  // namespace

void raise_failure(const RunResult& result) {
  if (result.fault && result.fault->fault.error) std::rethrow_exception(result.fault->fault.error);
}

RunResult run_worker_group(WorkerGroup& group, std::span<const std::unique_ptr<LogicalProcess>> lps,
                           VirtualTime end, const ThreadsOptions& options,
                           const ProgressFn& progress) {
  SODA_ASSERT(options.threads >= 1 && options.window >= 0, "threads ", options.threads, ", window ",
              options.window);
  std::deque<Worker> workers;
  for (std::size_t i = 0; i < group.inboxes.size(); ++i)
    workers.emplace_back(i, group, lps, end, options, progress);

  FirstError first;
  {
    const std::vector<std::jthread> threads = start_workers(workers, group, first);
    run_worker(workers[0], group, first);
  }
  if (first.error) std::rethrow_exception(first.error);

  RunResult result;
  const WorkerClock::Point ended = std::chrono::steady_clock::now();
  if (options.recording.accounts) result.account.emplace();
  for (Worker& worker : workers) {
    result.counters += worker.counters();
    result.kinds += worker.kinds();
    if (result.account) *result.account += worker.account(ended);
  }
  result.counters.gvt_rounds = group.rounds.rounds();
  result.fault = workers.front().fault();
  result.stopped = workers.front().stopped();
  result.stopped_at = workers.front().gvt();
  raise_failure(result);
  return result;
}

RunResult run_threads(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                      const ThreadsOptions& options, const ProgressFn& progress) {
  if (lps.empty()) return {};
  const std::size_t workers = std::min<std::size_t>(options.threads, lps.size());
  WorkerGroup group({lps.size(), workers}, 0, workers, nullptr);
  return run_worker_group(group, lps, end, options, progress);
}

}  // namespace soda::kernel
