// `soda rollback`: what a rollback costs in each mode, and how far `warm` strays from the exact
// trajectory.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/runs/overrides.hpp"
#include "analysis/runs/warnings.hpp"

namespace soda::analysis {

struct RollbackRequest {
  std::string file;
  Overrides overrides;
  bool json = false;
};

// One mode on the same virtual cluster. Deviations are from the sequential run, the largest over
// all committed steps and bodies; 0 means equal bits if no step differs.
struct ModeMeasures {
  models::RollbackMode mode{};
  std::uint64_t rollbacks = 0;
  std::uint64_t steps_repeated = 0;
  std::uint64_t islands_solved = 0, islands_wasted = 0;  // by a world; beyond those committed
  std::uint64_t islands_warm = 0;                        // of those solved
  std::uint64_t iterations = 0;                          // sweeps, over all solves
  double makespan_s = 0.0;                               // on the virtual clock
  double cpu_s = 0.0;
  std::optional<std::int64_t> first_different_step;
  double position_deviation_m = 0.0, velocity_deviation_m_s = 0.0;
};

struct RollbackReport {
  std::string scenario;
  std::int64_t steps = 0;
  std::uint32_t worlds = 0;
  std::vector<ModeMeasures> modes;  // propagate, invalidate, warm
  FileWarnings warnings;
};

RollbackReport compare_rollbacks(const RollbackRequest& request);

int rollback_command(const RollbackRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
