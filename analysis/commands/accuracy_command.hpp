// `soda accuracy`: error against run time over the cases of scenarios/cases.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "analysis/accuracy/case_run.hpp"
#include "analysis/runs/warnings.hpp"

namespace soda::analysis {

inline constexpr const char* kOwnCases = "scenarios/cases";

struct AccuracyRequest {
  std::vector<std::string> cases;  // names or files; empty: all of the folder
  std::string folder = kOwnCases;
  std::vector<std::string> steps_s;  // --dt: numbers or fractions, "1/60"; empty: the scene's
  // --tolerance: of soda's accuracy mode, at the scene's step. Steps are run beside them only if
  // they are asked for.
  std::vector<double> tolerances;
  std::vector<int> iterations;  // empty: the scene's, or the engine's own
  std::vector<std::string> engines = {"soda"};
  bool sweep = false;  // the scene's dt, halved four times
  RepeatRule timing{.budget_s = 60.0};
  bool extremes = false;  // extremes.hpp instead of cases
  bool families = false;  // families/family.hpp instead of cases, which are their names then
  bool full = false;      // with their largest n
  bool strict = false;    // warnings of cases are errors
  bool check = false;     // exit 1 if a must is missed
  bool json = false;
  std::string html_file;  // empty: none
  std::string command;    // as typed, for the page
  bool force = false;     // replaces it if it exists
};

// Everything that was run, in the order of cases, engines, iterations and steps.
struct AccuracyReport {
  struct Case {
    std::string name, description;
    std::vector<CaseRun> runs;
    std::vector<std::string> left_out;  // "engine: why", and settings beyond the budget
  };
  std::vector<Case> cases;
  std::vector<std::string> missing_engines;  // asked for, but not in this build
  std::vector<FileWarnings> warnings;

  std::size_t missed() const;  // measures over their must, and runs with a fault, of soda
};

// In a folder, ascending. Throws FileError.
std::vector<std::string> case_names(const std::string& folder);

AccuracyReport measure_accuracy(const AccuracyRequest& request, std::ostream& progress);

// Throws UsageError, scenarios::InputError or FileError.
int accuracy_command(const AccuracyRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
