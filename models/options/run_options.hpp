// How a scene is run: the executor and what SODA's parts are to do. No option but kWarm and the
// inputs changes a committed bit.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/api/transport.hpp"
#include "kernel/executors/recorded_executor.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "models/options/cost_weights.hpp"
#include "models/options/entry_observer.hpp"
#include "models/territory/territory.hpp"
#include "models/user_input/user_input.hpp"

namespace soda::models {

// What a rollback costs. The committed bits are the same, but for kWarm: its bits depend on which
// rollbacks there were.
enum class RollbackMode {
  kPropagate,   // re-executed steps compute again only what changed
  kInvalidate,  // they compute all again: the baseline
  kWarm,        // as kPropagate, and solves start from the multipliers of the replaced execution
};

// What a world takes for the ghosts of a step that a neighbour has not sent yet, though it has sent
// ghosts in the step before. The committed bits are the same; see extrapolated_ghosts.hpp.
enum class GhostMode {
  kReceivedOnly,   // nothing: it ignores bodies that it has not received
  kDeadReckoning,  // bodies that go on with constant velocity, as distributed games do
  kPredicted,      // what their owner computes of them if nothing touches them
};

// Who decides about territories. The committed bits are the same.
enum class BalancingPolicy {
  kOff,     // they stay as they are
  kPaper,   // cells go from loaded worlds to their neighbours: load_balancer.hpp
  kRandom,  // cells change hands at random: for tests
};

struct BalancingOptions {
  BalancingPolicy policy = BalancingPolicy::kOff;
  std::int64_t interval = 10;  // steps between decisions, >= 1
  std::uint64_t seed = 1;      // kRandom only
};

// In which order a traced run was executed.
struct RecordedExecution {
  kernel::RecordedOrder order;
  std::vector<TerritoryChange> territory_changes = {};  // by balancing, in order of steps
  bool over_ranks = false;
};

enum class ExecutorKind { kSequential, kThreads, kVirtual, kMpi };

struct RunOptions {
  ExecutorKind executor = ExecutorKind::kSequential;
  unsigned threads = 1;               // kThreads: >= 1; kMpi: of each rank
  std::int64_t first_step = 0;        // before which the run begins, >= 0
  std::int64_t steps = 0;             // after which it ends, counted from 0; >= first_step
  std::int64_t buffer = 48;           // entries of each world's transform buffer, >= 1
  std::uint64_t scheduling_seed = 0;  // see kernel::ThreadsOptions
  RollbackMode rollback = RollbackMode::kPropagate;
  bool gating = true;  // worlds whose bodies touch wait for each other (dependencies.hpp)
  // Large islands that lie on several processors are solved block by block, each by one of them
  // (split_plan.hpp); else each solves the whole. Needs dependency waits, and no extrapolated
  // ghosts. The committed bits are the same.
  bool split_islands = true;
  GhostMode ghosts = GhostMode::kReceivedOnly;
  BalancingOptions balancing = {};
  // kMpi only: the other ranks, each of which makes the same call.
  kernel::Transport* transport = nullptr;
  // Not for kSequential.
  kernel::Synchronisation synchronisation = kernel::Synchronisation::kOptimistic;
  InputOptions inputs = {};
  // Who sends to worlds from outside; each outlives the run. Over ranks, the root's count.
  std::vector<kernel::ExternalSource*> external_sources = {};
  EntryObserver* entries = nullptr;  // who is told how far worlds are; outlives the run. Over
                                     // ranks, all have one or none has
  // Ends the run at the next commit when it is no longer 0; may be null, or outlives the run.
  const kernel::StopRequest* stop = nullptr;
  // kVirtual only. Its window and synchronisation are those above, and its costs are those of
  // work_cost.hpp with `weights` unless `constant_cost`: then each event costs bag_cost_ns, and
  // nothing else does.
  kernel::VirtualOptions cluster = {};
  // What an event costs that would cost the second argument; none: that.
  std::function<std::int64_t(WorldId, std::int64_t)> event_cost_ns = {};
  bool constant_cost = false;
  CostWeights weights = {};
  // A traced run again, instead of what `executor` says. `external_sources` must be none, and
  // inputs a script.
  const RecordedExecution* recorded = nullptr;
};

}  // namespace soda::models
