// `soda fuzz`: random scenes by seed, under checks that hold for any scene; a failing one is shrunk
// to a scenario file.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "analysis/commands/continuity_command.hpp"
#include "analysis/commands/whole_command.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/search/fuzz_search.hpp"

namespace soda::analysis {

struct FuzzRequest {
  std::vector<std::string> files = {};  // scenarios to check instead of random ones
  std::string seeds = "1..200";         // FIRST..LAST
  double budget_s = 0.0;                // start no trial after this; 0: no limit
  std::int64_t steps = 60;              // of a random scene
  bool joints = false;                  // in every scene; some let bodies through floors
  bool springs = false;                 // in every scene, instead
  unsigned most_failures = 1;           // ends the search
  unsigned most_shrinking = 400;        // trials, for each failure
  std::string folder;                   // where shrunk scenes are written; empty: they are printed
  bool force = false;                   // replaces files there
  bool strict = false;                  // warnings of the files are errors
  bool json = false;
  // Other searches in place of this one, with what only they have.
  bool is_whole = false, is_continuity = false;
  WholeRequest whole;
  ContinuityRequest continuity;
  unsigned jobs = 1;  // of these two
};

struct FuzzFailure {
  std::uint64_t seed = 0;  // of a random scene
  std::string file;        // that was checked, or that was written; empty: neither
  std::string what;        // of the scene as drawn
  std::string shrunk_what;
  unsigned tried = 0;
  std::string text;  // the shrunk scenario; empty where a file was checked
};

struct FuzzResult {
  std::uint64_t trials = 0;
  FuzzSums sums;
  double wall_s = 0.0;
  bool out_of_time = false;  // not all seeds were tried, or not all made as small as they go
  std::vector<FuzzFailure> failures;
  std::vector<FileWarnings> warnings;
};

// Throws UsageError, and FileError where a file cannot be read or written.
FuzzResult fuzz(const FuzzRequest& request);

// Returns kExitOk, or kExitCheckFailed after telling what failed.
int fuzz_command(const FuzzRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
