// `soda swarm`: deterministic simulation testing. Random models, clusters and adversaries by seed;
// every commit is checked against the oracle; a failing seed is shrunk.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/runs/warnings.hpp"
#include "analysis/search/swarm_search.hpp"

namespace soda::analysis {

struct SwarmRequest {
  std::vector<std::string> files = {};  // scenarios; none: PHOLD
  std::string seeds = "1..200";         // FIRST..LAST
  double budget_s = 0.0;                // start no trial after this; 0: no limit
  std::int64_t most_steps = 20;         // of a scenario
  // Instead of what the seed draws: to reproduce a shrunk trial.
  std::optional<std::uint32_t> lps = {}, processors = {};
  std::optional<std::int64_t> end = {}, window = {};
  std::optional<std::string> decisions = {};
  unsigned most_shrinking = 400;  // trials
  bool strict = false;            // warnings of scenarios are errors
  bool json = false;
};

struct SwarmFailure {
  std::string file;
  std::uint64_t seed = 0;
  std::string what;  // of the trial as drawn
  ShrunkTrial smallest;
  std::string command;  // that reproduces the smallest
};

struct SwarmResult {
  std::uint64_t trials = 0;
  TrialSums sums;
  double wall_s = 0.0;
  bool out_of_time = false;             // not all seeds were tried, or it could be smaller
  std::optional<SwarmFailure> failure;  // ends the search
  std::vector<FileWarnings> warnings;
};

// Throws what load_scenario throws, and UsageError.
SwarmResult swarm(const SwarmRequest& request);

// Returns kExitOk, or kExitCheckFailed after telling how to reproduce the failure.
int swarm_command(const SwarmRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
