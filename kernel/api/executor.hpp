// Running a set of logical processes to an end time: what all executors share.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "kernel/api/counters.hpp"
#include "kernel/api/event_recorder.hpp"
#include "kernel/api/external_source.hpp"
#include "kernel/api/logical_process.hpp"
#include "kernel/api/time_account.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// A fault that GVT passed: the run's outcome.
struct CommittedFault {
  VirtualTime when;
  LpId lp{};
  Fault fault;
};

// The order of faults: of one time, that of the lowest subject comes first, whoever met it. So the
// outcome does not depend on how a model deals its subjects out among LPs.
inline bool comes_before(const CommittedFault& a, const CommittedFault& b) {
  return std::tie(a.when, a.fault.subject, a.lp) < std::tie(b.when, b.fault.subject, b.lp);
}

// Keeps the first of two faults; of equals the one that is there already.
inline void keep_first(const std::optional<CommittedFault>& other,
                       std::optional<CommittedFault>& first) {
  if (other && (!first || comes_before(*other, *first))) first = other;
}

// A request to end a run early, from any thread or a signal handler. 0: go on. Anything else, once
// and for all: why, for whoever asked. Looked at whenever GVT is announced; the largest of those of
// all ranks counts.
using StopRequest = std::atomic<std::uint32_t>;

struct RunResult {
  Counters counters;
  EventCounts kinds;  // if they were recorded
  // Of worker threads, if asked for. What stands is `useful`: only the model can tell more.
  std::optional<TimeAccount> account;
  // The first fault: see comes_before(). Everything before its time has been committed, nothing at
  // or after it.
  std::optional<CommittedFault> fault;
  // The value of the request that ended the run before its end; 0: it came to its end or a fault.
  std::uint32_t stopped = 0;
  VirtualTime stopped_at = kBeginning;  // if so: what is earlier has been committed, nothing else
};

// Throws what left a handler, if that is the outcome.
void raise_failure(const RunResult& result);

// Called after everything before `gvt` (<= end) has been committed, one call at a time, from any
// worker thread. For progress displays; must be cheap.
using ProgressFn = std::function<void(VirtualTime gvt, const Counters& so_far)>;

// Executes every time < end of every LP, in increasing (time, LP) order, from one queue: no
// checkpoint, no rollback, nothing shared with the Time Warp executors but the LP interface.
// The oracle that the others are compared with. A time is committed when all LPs have executed it.
// LP i of the span is LpId{i}. An exception that leaves a handler is thrown here, by all executors
// when everything before its time has been committed and nothing else: see
// LogicalProcess::execute(). `external` may be null; nothing runs ahead of its floor: a time is
// executed when the floor has passed it. A stop request (or null) is looked at before each new t.
RunResult run_sequential(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                         const ProgressFn& progress = {}, ExternalSource* external = nullptr,
                         const StopRequest* stop = nullptr, const Recording& recording = {});

// What makes sure that causes come before effects.
enum class Synchronisation {
  kOptimistic,  // Time Warp
  kLockstep,    // no LP executes a time before all have executed what is earlier: the baseline
};

// A window that follows the work instead of virtual time, whatever a model's unit of t is: a worker
// (or modelled processor) executes what is earliest until it has most_uncommitted() executions that
// GVT has not passed, and then only what is at GVT.t. More do not pay: of few LPs they are rolled
// back, of thousands they leave the cache (docs/decisions/kernel-default-window.md).
inline constexpr std::int64_t kWindowByWork = 0;

// Of a worker with so many LPs. What it holds beyond is what it executes between two looks at its
// inbox, and what is at GVT.t.
constexpr std::uint64_t most_uncommitted(std::uint64_t lps) {
  return std::min<std::uint64_t>(16 * lps, 1024);
}

struct ThreadsOptions {
  unsigned threads = 1;  // >= 1, not more than LPs are used; LP i belongs to worker
                         // i * threads / number of LPs
  // An LP may execute times with t < GVT.t + window, if one is set (>= 1). Bounds memory, as the
  // default does.
  std::int64_t window = kWindowByWork;
  // 0: each worker takes its lowest time first. Otherwise the seed of a scheduler that picks
  // eligible LPs, message intake and GVT rounds at random, to exercise rollbacks.
  std::uint64_t scheduling_seed = 0;
  Synchronisation synchronisation = Synchronisation::kOptimistic;
  // May be null, or must outlive the run. Of ranks, the root's counts.
  ExternalSource* external = nullptr;
  const StopRequest* stop = nullptr;  // the same; of ranks, that of any ends the run of all
  Recording recording = {};           // of ranks, each has its own trace
};

// The system has started fewer threads than were asked for; those have ended.
class ThreadsNotStarted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Optimistic (Time Warp) execution of every time < end, over worker threads. Same committed
// outcome as run_sequential, for any options. May throw ThreadsNotStarted.
RunResult run_threads(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                      const ThreadsOptions& options, const ProgressFn& progress = {});

}  // namespace soda::kernel
