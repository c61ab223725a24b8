// `soda compare`: what the ways in which SODA can go about its work cost on one scene, and how far
// those that change bits stray from the exact trajectory.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/runs/overrides.hpp"
#include "analysis/runs/warnings.hpp"

namespace soda::analysis {

// What is varied.
enum class Aspect { kRollback, kGating, kGhosts, kBalancing, kIslands };
const char* name_of(Aspect aspect);

struct CompareRequest {
  std::string file;
  std::vector<std::string> over;  // names of aspects; none: all
  Overrides overrides;
  bool json = false, csv = false;
};

// One setting on the same virtual cluster. Deviations are from the sequential run, the largest over
// all committed steps and bodies; 0 means equal bits if no step differs.
struct SettingMeasures {
  std::string setting;
  std::uint64_t rollbacks = 0;
  std::uint64_t steps_repeated = 0;
  std::uint64_t islands_solved = 0, islands_wasted = 0;   // by a world; beyond those committed
  std::uint64_t islands_warm = 0;                         // of those solved
  std::uint64_t iterations = 0;                           // sweeps, over all solves
  std::uint64_t contacts_false = 0, contacts_missed = 0;  // see models::WorldCounters
  std::uint64_t ghosts_guessed = 0, ghosts_confirmed = 0;
  std::uint64_t cells_transferred = 0;
  double makespan_s = 0.0;  // on the virtual clock
  std::optional<std::int64_t> first_different_step;
  double position_deviation_m = 0.0, velocity_deviation_m_s = 0.0;
};

struct AspectMeasures {
  Aspect aspect{};
  std::vector<SettingMeasures> settings;
};

struct CompareReport {
  std::string scenario;
  std::int64_t steps = 0;
  std::uint32_t worlds = 0;
  std::vector<AspectMeasures> aspects;
  FileWarnings warnings;
};

CompareReport compare_settings(const CompareRequest& request);

int compare_command(const CompareRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
