// `soda verify`: one trajectory, checked. A scenario runs under a matrix of executors, threads,
// worlds, buffers and scheduling seeds; every committed step must have the digest of the plain
// sequential run of one world.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/runs/warnings.hpp"
#include "models/options/run_options.hpp"
#include "models/territory/territory.hpp"

namespace soda::analysis {

struct VerifyRequest {
  std::string file;
  std::optional<std::int64_t> steps;  // shortens the scenario
  std::vector<unsigned> threads{1, 2, 4};
  std::vector<std::uint32_t> worlds{1, 2, 4, 12, 48};
  std::vector<std::int64_t> buffers{1, 4, 48};
  // Scheduling seeds 0 .. seeds. With 0, the run is the one that `soda run` makes of the scenario:
  // its modes, its input, nothing at random. Of the others, with every other one, rollbacks
  // invalidate whole entries; with two of four, worlds do not wait for each other (dependency
  // waits). Of three, with the first cells change hands at random, with the second by the paper's
  // scheme. Told, dead-reckoning and predicted ghosts take turns, in nine seeds with each of these
  // three.
  unsigned seeds = 5;
  bool all_modes = false;  // instead, each seed, 0 too, with all 36 combinations
  std::optional<std::uint64_t> random_inputs;  // seed of user input beside the scenario's
  kernel::Transport* transport = nullptr;      // the runs are those of the job's ranks
  bool require_rollbacks = false;  // fail if no run rolled back: then nothing was proved
  bool strict = false;             // warnings of the scenario are errors
  bool json = false;
};

// A body's field that differs from the oracle's, at the first step where any does.
struct Divergence {
  std::int64_t step = 0;
  std::uint32_t body_label = 0;
  std::string field;
  double expected = 0.0, found = 0.0;
};

struct VerifiedRun {
  models::ExecutorKind executor = models::ExecutorKind::kSequential;
  std::uint32_t ranks = 1;
  unsigned threads = 1;  // of each rank
  std::uint32_t worlds = 1;
  std::int64_t buffer = 1;
  std::uint64_t scheduling_seed = 0;
  models::RollbackMode rollback = models::RollbackMode::kPropagate;
  bool gating = true;
  models::GhostMode ghosts = models::GhostMode::kReceivedOnly;
  models::BalancingPolicy balancing = models::BalancingPolicy::kOff;
  std::size_t territory_changes = 0;
  kernel::Counters events;
  std::optional<Divergence> divergence;
};

// The result of a matrix; `runs` ends with the first that diverged.
struct Verification {
  std::string scenario;
  std::int64_t steps = 0;
  std::uint64_t digest = 0;  // of the oracle's last step
  std::vector<VerifiedRun> runs;
  FileWarnings warnings;

  bool diverged() const { return !runs.empty() && runs.back().divergence.has_value(); }
  std::uint64_t rollbacks() const;
  kernel::Counters events() const;  // of all runs
  std::size_t territory_changes() const;
};

// Throws what load_scenario throws. In a job all ranks call it, and the root has the result.
Verification verify(const VerifyRequest& request);

// Returns kExitOk, or kExitCheckFailed after naming the first divergence.
int verify_command(const VerifyRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
