// `soda fuzz --whole`: random scenarios as files, run by the built program with any executor and
// compared step by step with the plain loop.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "analysis/whole/whole_trial.hpp"
#include "analysis/whole/whole_workers.hpp"

namespace soda::analysis {

struct WholeRequest {
  std::string seeds = "1..200";             // FIRST..LAST
  std::vector<std::string> executors = {};  // by name; empty: all that can be had here
  std::string program;                      // empty: this one
  unsigned jobs = 1;                        // trials at a time
  double budget_s = 0.0;                    // start no trial after this; 0: no limit
  double patience_s = 20.0;                 // as of WholePlace
  unsigned most_failures = 1;               // ends the search
  unsigned most_shrinking = 400;            // trials, for each failure
  std::string folder;                       // for failing scenes; empty: they are printed
  bool json = false;
};

struct WholeFailure {
  std::uint64_t seed = 0;
  std::string kind, what, shrunk_what;
  unsigned tried = 0;
  std::string command;  // as typed, on `file`
  std::string file;     // that was written; empty: none
  std::string text;     // the shrunk scenario
};

// A scene whose plain loop ends with a fault: soda does what it promises, but is it right?
struct SuspiciousScene {
  std::uint64_t seed = 0;
  std::string what;
};

struct WholeResult {
  std::uint64_t trials = 0;
  WholeSums sums;
  std::vector<WholeFailure> failures;       // by seed
  std::vector<SuspiciousScene> suspicious;  // by seed
  std::string left_out;                     // which executors, and why
  double wall_s = 0.0;
  SearchEnd end;
};

// Trials run in `jobs` processes. Progress goes to standard error where that is a terminal. Throws
// UsageError, FileError.
WholeResult fuzz_whole(const WholeRequest& request);

std::string whole_text(const WholeResult& result);

// Tells what failed, also of a search that a signal ended early. Returns exit_code_of().
int whole_command(const WholeRequest& request, std::ostream& out);

}  // namespace soda::analysis
