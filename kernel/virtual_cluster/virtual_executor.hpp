// The virtual cluster: Time Warp on P modelled processors and a modelled network, in one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "kernel/api/executor.hpp"
#include "kernel/api/message.hpp"
#include "kernel/api/run_observer.hpp"
#include "kernel/api/time_account.hpp"
#include "kernel/virtual_cluster/adversary.hpp"

namespace soda::kernel {

// A message that came late in a run, and that its receiver waits for when the run is repeated: its
// message id, and the least version that will do.
struct AwaitedMessage {
  LpId source{}, destination{};
  VirtualTime time;
  std::uint32_t kind = 0, slot = 0;
  std::uint64_t version = 0;

  bool is_id_of(const Message& message) const {
    return message.source == source && message.destination == destination && message.time == time &&
           message.kind == kind && message.slot == slot;
  }
};

// Acts at times of the virtual wall clock that it chooses: a renderer, say.
class ClockUser {
 public:
  virtual ~ClockUser() = default;
  // Before each action of the cluster: the clock shows `now_ns`, which never falls.
  virtual void set_now(std::int64_t now_ns) = 0;
  // The time of its next act(), or none. It is asked again before each action of the cluster.
  virtual std::optional<std::int64_t> next_ns() = 0;
  // The clock shows next_ns(), or more if that had passed. The cluster has done all that it does at
  // that time.
  virtual void act() = 0;
};

// Times of the virtual wall clock are integer nanoseconds.
struct VirtualOptions {
  unsigned processors = 1;  // >= 1, not more than LPs are used; LP i belongs to processor
                            // i * processors / number of LPs
  std::int64_t window = kWindowByWork;  // as in ThreadsOptions
  Synchronisation synchronisation = Synchronisation::kOptimistic;
  std::uint64_t seed = 0;  // of the jitter
  // Cost of the bag that an LP executed last; asked once after each execution. None: each costs
  // bag_cost_ns, all useful.
  std::function<ExecutionCost(LpId)> cost = {};
  std::int64_t bag_cost_ns = 1000;
  // Of its time, what a processor gives to each computation of GVT (in lockstep nothing), and to
  // each execution that is committed.
  std::int64_t gvt_cost_ns = 0, commit_cost_ns = 0;
  std::int64_t latency_ns = 10'000;        // of a message between processors
  std::int64_t jitter_ns = 0;              // more latency, uniform over 0 .. jitter_ns
  std::int64_t bytes_per_s = 0;            // that a processor can send; 0: no limit
  std::int64_t gvt_interval_ns = 100'000;  // between the ends and starts of GVT computations
  std::int64_t gvt_delay_ns = 20'000;      // that one takes; also what a barrier takes
  bool check_purity = false;               // every execution is repeated and compared
  std::uint64_t max_actions = 0;  // without GVT; a run with more throws Violation; 0: no limit
  // All may be null, or must outlive the run. Messages from outside take the latency of the
  // network, but no bandwidth. With an adversary, runs are still reproducible.
  Adversary* adversary = nullptr;
  RunObserver* observer = nullptr;
  ExternalSource* external = nullptr;
  // With a GVT that takes no time, one is computed before it acts, after, and whenever a processor
  // has nothing to execute. Not with lockstep.
  ClockUser* clock_user = nullptr;
  const StopRequest* stop = nullptr;
  // Its destination executes nothing of its time or later before it is there, as if it were
  // delivered in time; or before nothing else is left to happen, if it is not sent any more.
  std::optional<AwaitedMessage> awaited = {};
  Recording recording = {};  // one chunk after the other, in the order of what happens
};

struct VirtualReport {
  unsigned processors = 1;
  std::int64_t makespan_ns = 0;       // when the last execution had ended
  TimeAccount account;                // of processors * makespan_ns
  std::uint64_t remote_messages = 0;  // between processors, anti-messages included
  std::uint64_t remote_bytes = 0;     // with kHeaderBytes each
  std::uint64_t barriers = 0;         // lockstep only
  std::uint64_t most_history = 0;     // executed times held by all LPs at once, at a GVT
  // Over every action, in order: equal for two runs with equal options, whatever the machine.
  std::uint64_t execution_digest = 0;
};

inline constexpr std::uint64_t kHeaderBytes = 48;  // of a message on the network

struct VirtualResult {
  RunResult run;
  VirtualReport report;
};

// Executes every time < end of every LP. Same committed outcome as run_sequential, for any options.
//
// A processor takes in what has arrived, settles it at no cost, and executes the LP with the lowest
// floor within the window; what that sends leaves when its cost has passed. An execution is not
// interrupted. Synchronisation::kLockstep is the baseline instead: no LP executes a time before all
// have executed what is earlier. A barrier is paid for after times at which something was sent, and
// where t changes; elsewhere processors go on as if they knew that there was nothing to wait for.
VirtualResult run_virtual(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const VirtualOptions& options, const ProgressFn& progress = {});

}  // namespace soda::kernel
