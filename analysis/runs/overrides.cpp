#include "analysis/runs/overrides.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/process/installed.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "scenarios/format.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

template <class T>
void take(std::optional<T>& target, const std::optional<T>& source) {
  if (source) target = source;
}

void require_at_least(std::int64_t value, std::int64_t smallest, const char* option) {
  if (value >= smallest) return;
  throw UsageError(std::string(option) + ": found " + std::to_string(value) +
                   "; allowed: at least " + std::to_string(smallest));
}

// As in scenario files: what is larger is out of memory at best, and overflows at worst.
void require_within(std::int64_t value, std::int64_t smallest, std::int64_t largest,
                    const char* option) {
  require_at_least(value, smallest, option);
  if (value <= largest) return;
  throw UsageError(std::string(option) + ": found " + std::to_string(value) +
                   "; allowed: at most " + std::to_string(largest));
}

// True if the ranks of a job execute the run.
bool apply_job(const Overrides& overrides, models::RunOptions& run) {
  const bool wanted = overrides.executor == models::ExecutorKind::kMpi;
  if (overrides.transport == nullptr) {
    if (wanted) throw UsageError("--executor mpi: start the program with mpirun -n RANKS soda ...");
    return false;
  }
  if ((overrides.executor && !wanted) || overrides.cluster.given())
    throw UsageError("started by mpirun with another executor; allowed: --executor mpi");
  run.executor = models::ExecutorKind::kMpi;
  run.transport = overrides.transport;
  run.threads = overrides.threads.value_or(1);
  require_at_least(run.threads, 1, "--threads");
  return true;
}

void apply_executor(const Overrides& overrides, models::RunOptions& run) {
  if (apply_job(overrides, run)) return;
  if (overrides.executor) run.executor = *overrides.executor;
  if (overrides.cluster.given()) {
    if (overrides.executor && overrides.executor != models::ExecutorKind::kVirtual)
      throw UsageError(
          "--processors, --latency-us and the like: they belong to the virtual "
          "executor; allowed: --executor virtual");
    run.executor = models::ExecutorKind::kVirtual;
  }
  if (!overrides.threads) return;
  require_at_least(*overrides.threads, 1, "--threads");
  if (overrides.executor == models::ExecutorKind::kSequential ||
      run.executor == models::ExecutorKind::kVirtual) {
    if (*overrides.threads == 1) return;
    throw UsageError(std::string("--threads: the ") + name_of(run.executor) +
                     " executor has one thread; allowed: 1, or --executor threads");
  }
  run.executor = models::ExecutorKind::kThreads;
  run.threads = *overrides.threads;
}

std::int64_t nanoseconds(double microseconds, const char* option) {
  constexpr double kMost_us = 1e12;
  if (!(microseconds >= 0.0 && microseconds <= kMost_us))
    throw UsageError(std::string(option) + ": found " + format_number(microseconds) +
                     "; allowed: 0 to 1e12");
  return std::llround(1000.0 * microseconds);
}

}  // namespace

const char* name_of(models::ExecutorKind executor) {
  switch (executor) {
    case models::ExecutorKind::kSequential:
      return "sequential";
    case models::ExecutorKind::kThreads:
      return "threads";
    case models::ExecutorKind::kVirtual:
      return "virtual";
    case models::ExecutorKind::kMpi:
      return "mpi";
  }
  return "";
}

const char* name_of(kernel::Synchronisation policy) {
  return policy == kernel::Synchronisation::kLockstep ? "lockstep" : "optimistic";
}

const char* name_of(models::RollbackMode rollback) {
  switch (rollback) {
    case models::RollbackMode::kPropagate:
      return "propagate";
    case models::RollbackMode::kInvalidate:
      return "invalidate";
    case models::RollbackMode::kWarm:
      return "warm";
  }
  return "";
}

const char* name_of(models::GhostMode ghosts) {
  switch (ghosts) {
    case models::GhostMode::kReceivedOnly:
      return "told";
    case models::GhostMode::kDeadReckoning:
      return "dead-reckoning";
    case models::GhostMode::kPredicted:
      return "predicted";
  }
  return "";
}

const char* name_of(models::BalancingPolicy policy) {
  switch (policy) {
    case models::BalancingPolicy::kOff:
      return "off";
    case models::BalancingPolicy::kPaper:
      return "paper";
    case models::BalancingPolicy::kRandom:
      return "random";
  }
  return "";
}

Overrides combined(const Overrides& base, const Overrides& over) {
  Overrides result = base;
  // A thread count and a cluster belong to their executor: one asked for anew inherits neither.
  if (over.executor) result.threads.reset();
  if ((over.threads || over.cluster.given()) && !over.executor) result.executor.reset();
  if (over.cluster.given()) result.threads.reset();
  const bool leaves_cluster =
      over.threads ||
      over.executor.value_or(models::ExecutorKind::kVirtual) != models::ExecutorKind::kVirtual;
  if (leaves_cluster) result.cluster = {};
  take(result.executor, over.executor);
  take(result.threads, over.threads);
  take(result.worlds, over.worlds);
  take(result.buffer, over.buffer);
  take(result.steps, over.steps);
  take(result.seed, over.seed);
  take(result.scheduling_seed, over.scheduling_seed);
  take(result.policy, over.policy);
  take(result.rollback, over.rollback);
  take(result.gating, over.gating);
  take(result.split_islands, over.split_islands);
  take(result.ghosts, over.ghosts);
  take(result.balancing, over.balancing);
  take(result.balancing_interval, over.balancing_interval);
  take(result.balancing_seed, over.balancing_seed);
  result.strict = base.strict || over.strict;
  if (over.transport != nullptr) result.transport = over.transport;
  take(result.cluster.processors, over.cluster.processors);
  take(result.cluster.latency_us, over.cluster.latency_us);
  take(result.cluster.jitter_us, over.cluster.jitter_us);
  take(result.cluster.cost_us, over.cluster.cost_us);
  take(result.cluster.bandwidth_mb_s, over.cluster.bandwidth_mb_s);
  take(result.cluster.gvt_interval_us, over.cluster.gvt_interval_us);
  take(result.cluster.execution_seed, over.cluster.execution_seed);
  result.cluster.check_purity = result.cluster.check_purity || over.cluster.check_purity;
  return result;
}

void apply_overrides(const Overrides& overrides, models::TerritoryOptions& territory,
                     models::RunOptions& run) {
  apply_executor(overrides, run);
  if (overrides.worlds) {
    require_at_least(*overrides.worlds, 1, "--worlds");
    if (*overrides.worlds > territory.grid.cell_count()) {
      throw UsageError("--worlds: found " + std::to_string(*overrides.worlds) +
                       "; allowed: at most the scenario's " +
                       std::to_string(territory.grid.cell_count()) + " cells");
    }
    territory.worlds = *overrides.worlds;
  }
  if (overrides.buffer) {
    require_within(*overrides.buffer, 1, scenarios::kMaxBufferEntries, "--buffer");
    run.buffer = *overrides.buffer;
  }
  if (overrides.steps) {
    require_within(*overrides.steps, 0, scenarios::kMaxSteps, "--steps");
    run.steps = *overrides.steps;
  }
  if (overrides.scheduling_seed) run.scheduling_seed = *overrides.scheduling_seed;
  if (overrides.policy) run.synchronisation = *overrides.policy;
  if (overrides.rollback) run.rollback = *overrides.rollback;
  if (overrides.gating) run.gating = *overrides.gating;
  if (overrides.split_islands) run.split_islands = *overrides.split_islands;
  if (overrides.ghosts) run.ghosts = *overrides.ghosts;
  if (overrides.balancing) run.balancing.policy = *overrides.balancing;
  if (overrides.balancing_interval) {
    require_within(*overrides.balancing_interval, 1, scenarios::kMaxBalancingInterval,
                   "--balancing-interval");
    run.balancing.interval = *overrides.balancing_interval;
  }
  if (overrides.balancing_seed) run.balancing.seed = *overrides.balancing_seed;
  run.constant_cost = overrides.cluster.cost_us.has_value();
  apply_cluster(overrides.cluster, territory.worlds, run.cluster);
}

void apply_cluster(const ClusterOverrides& overrides, std::uint32_t lps,
                   kernel::VirtualOptions& cluster) {
  if (overrides.processors) require_at_least(*overrides.processors, 1, "--processors");
  cluster.processors = overrides.processors.value_or(lps);
  if (overrides.latency_us) cluster.latency_ns = nanoseconds(*overrides.latency_us, "--latency-us");
  if (overrides.jitter_us) cluster.jitter_ns = nanoseconds(*overrides.jitter_us, "--jitter-us");
  if (overrides.gvt_interval_us)
    cluster.gvt_interval_ns = nanoseconds(*overrides.gvt_interval_us, "--gvt-interval-us");
  if (overrides.bandwidth_mb_s) {
    if (!(*overrides.bandwidth_mb_s >= 1e-3 && *overrides.bandwidth_mb_s <= 1e9))
      throw UsageError("--bandwidth-mb-s: found " + format_number(*overrides.bandwidth_mb_s) +
                       "; allowed: 1e-3 to 1e9");
    cluster.bytes_per_s = std::llround(1e6 * *overrides.bandwidth_mb_s);
  }
  if (overrides.cost_us) cluster.bag_cost_ns = nanoseconds(*overrides.cost_us, "--cost-us");
  if (overrides.execution_seed) cluster.seed = *overrides.execution_seed;
  cluster.check_purity = overrides.check_purity;
  // There and back: a reduction to one processor and its answer.
  cluster.gvt_delay_ns = 2 * (cluster.latency_ns + cluster.jitter_ns);
}

scenarios::Scenario load_scenario(const std::string& file, const Overrides& overrides) {
  scenarios::Scenario scenario = scenarios::read_scenario_file(installed(file), overrides.seed);
  if (overrides.strict) refuse_warnings(file, scenario.warnings);
  apply_overrides(overrides, scenario.territory, scenario.run);
  return scenario;
}

std::vector<std::string> scenario_files(std::vector<std::string> files,
                                        const std::string& library) {
  if (library.empty()) {
    if (files.empty()) throw UsageError("FILE is required, or --library FOLDER");
    return files;
  }
  std::error_code error;
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(installed(library), error))
    if (entry.path().extension() == ".json") found.push_back(entry.path().string());
  if (error) throw scenarios::FileError(library + ": " + error.message());
  if (found.empty()) throw UsageError("--library: no scenario in " + library);
  std::ranges::sort(found);
  files.insert(files.end(), found.begin(), found.end());
  return files;
}

}  // namespace soda::analysis
