// What a command line changes of a scenario.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scenarios/scenario.hpp"

namespace soda::analysis {

// Of the virtual cluster. Each of them alone selects the virtual executor.
struct ClusterOverrides {
  std::optional<unsigned> processors;  // default: one for each world, or LP
  std::optional<double> latency_us, jitter_us, cost_us;
  std::optional<double> bandwidth_mb_s;  // default: no limit
  std::optional<double> gvt_interval_us;
  std::optional<std::uint64_t> execution_seed;
  bool check_purity = false;

  bool given() const {
    return processors || latency_us || jitter_us || cost_us || bandwidth_mb_s || gvt_interval_us ||
           execution_seed || check_purity;
  }
};

// Nothing given: the scenario's own value.
struct Overrides {
  std::optional<models::ExecutorKind> executor;
  std::optional<unsigned> threads;  // alone, it also selects the threads executor
  std::optional<std::uint32_t> worlds;
  std::optional<std::int64_t> buffer;
  std::optional<std::int64_t> steps;
  std::optional<std::uint64_t> seed;  // replaces every seed of the scenario
  std::optional<std::uint64_t> scheduling_seed;
  std::optional<kernel::Synchronisation> policy;
  std::optional<models::RollbackMode> rollback;
  std::optional<bool> gating;
  std::optional<bool> split_islands;
  std::optional<models::GhostMode> ghosts;
  std::optional<models::BalancingPolicy> balancing;
  std::optional<std::int64_t> balancing_interval;
  std::optional<std::uint64_t> balancing_seed;
  ClusterOverrides cluster;
  bool strict = false;  // warnings of the scenario are errors
  // Of the job that mpirun started; it selects kMpi. Not written to logs.
  kernel::Transport* transport = nullptr;
};

const char* name_of(models::ExecutorKind executor);
const char* name_of(kernel::Synchronisation policy);
const char* name_of(models::RollbackMode rollback);
const char* name_of(models::GhostMode ghosts);
const char* name_of(models::BalancingPolicy policy);

// `over` where it says something, else `base`; but of an executor that `over` does not select,
// nothing: neither threads nor a cluster.
Overrides combined(const Overrides& base, const Overrides& over);

// Applies all but the seed, which acts while a scenario is read. Throws UsageError for values out
// of range: worlds beyond the number of cells, threads with the sequential executor, and so on.
void apply_overrides(const Overrides& overrides, models::TerritoryOptions& territory,
                     models::RunOptions& run);

// Of a cluster for `lps` LPs; its cost model is not touched, but by cost_us. Throws UsageError.
void apply_cluster(const ClusterOverrides& overrides, std::uint32_t lps,
                   kernel::VirtualOptions& cluster);

// Read and overridden. Throws InputError, FileError, UsageError.
scenarios::Scenario load_scenario(const std::string& file, const Overrides& overrides);

// `files`, then the scenarios of the folder `library` by name, if there is one. Throws UsageError
// if there are none at all, FileError if the folder cannot be read.
std::vector<std::string> scenario_files(std::vector<std::string> files, const std::string& library);

}  // namespace soda::analysis
