// `soda phold`: the benchmark of optimistic kernels, on ours.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>

#include "analysis/runs/overrides.hpp"
#include "kernel/api/transport.hpp"
#include "kernel/phold/standard_phold.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"

namespace soda::analysis {

struct PholdRequest {
  kernel::StandardPholdOptions model;
  double end_units = 100.0;  // > 0
  std::string executor = "sequential";
  unsigned threads = 1;
  kernel::Transport* transport = nullptr;         // of the job, for mpi
  double window_units = 0.0;                      // beyond GVT; 0: no window
  std::optional<kernel::Synchronisation> policy;  // not with the sequential executor
  ClusterOverrides cluster;                       // with the virtual executor only
  bool json = false;
};

struct PholdRun {
  kernel::Counters counters;
  kernel::StandardPholdResult result;
  double wall_s = 0.0;
  std::optional<kernel::VirtualReport> cluster = {};  // of the virtual executor

  double events_per_s() const { return static_cast<double>(result.events) / wall_s; }
  // Modelled: LPs are the same for any number of processors, so it is what stands.
  std::optional<std::int64_t> one_processor_ns() const {
    return cluster ? std::optional(cluster->account.standing.sum_ns()) : std::nullopt;
  }
};

// Creation of the LPs is not part of wall_s. Throws UsageError for an unknown executor, and for
// options of another one.
PholdRun run_phold(const PholdRequest& request);

int phold_command(const PholdRequest& request, std::ostream& out);

}  // namespace soda::analysis
