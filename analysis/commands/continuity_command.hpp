// `soda fuzz --continuity`: changes that should not matter, over random scenes; what fails is
// listed.
#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "analysis/whole/continuity_trial.hpp"
#include "analysis/whole/whole_workers.hpp"

namespace soda::analysis {

struct ContinuityRequest {
  std::string seeds = "1..200";         // FIRST..LAST
  std::vector<std::string> kinds = {};  // by name; empty: all
  unsigned jobs = 1;
  double budget_s = 0.0;       // begin no seed after this; 0: no limit
  unsigned most_failures = 1;  // seeds with failures; ends the search
  std::string folder;          // for scenes that fail, plain and changed; empty: none
  bool json = false;
};

struct ContinuityFailure {
  std::uint64_t seed = 0;
  ContinuityKind kind = ContinuityKind::kTinyForce;
  std::string what;
};

struct ContinuityTally {
  std::uint64_t trials = 0, same_bits = 0, rounding = 0, failed = 0, steps = 0;
  double worst = 0.0;  // deviation over what is allowed
};

struct ContinuityResult {
  std::array<ContinuityTally, kContinuityKinds> tallies{};
  std::vector<ContinuityFailure> failures;  // by seed and kind
  double wall_s = 0.0;
  SearchEnd end;
};

// Throws UsageError, FileError.
ContinuityResult check_continuity(const ContinuityRequest& request);

std::string continuity_text(const ContinuityResult& result);

// Lists what failed. Returns exit_code_of() (whole_workers.hpp).
int continuity_command(const ContinuityRequest& request, std::ostream& out);

}  // namespace soda::analysis
