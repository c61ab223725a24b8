// Families run: errors and costs over n, and where they jump.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "analysis/accuracy/case_run.hpp"
#include "analysis/families/family.hpp"

namespace soda::analysis {

// One scene of a family. All costs are per body and step.
struct FamilyRun {
  int n = 0;
  std::size_t bodies = 0;
  std::int64_t steps = 0;
  std::vector<double> errors;  // for each measure of the family
  std::string fault;           // of the first step that had one; empty: none
  double cpu_us = 0.0;         // median over repeats; 0: not timed
  double cpu_s = 0.0;          // of one whole run
  // Counts, the same on every machine: sums of all stages, in ns of a usual one, roughly; and the
  // larger of their parts.
  double work = 0.0;
  double impacts = 0.0, row_sweeps = 0.0, multiplications = 0.0;
};

enum class FamilyFinding { kFault, kBeyondBound, kErrorJump, kWorkJump, kTimeJump };
const char* name_of(FamilyFinding kind);

// What is not as it should be. A jump: from `from` at `from_n` to `to` at the next n.
struct FamilyMiss {
  FamilyFinding kind = FamilyFinding::kErrorJump;
  std::string measure;  // "work" or "CPU time": of costs; empty: of a fault
  int from_n = 0, n = 0;
  double from = 0.0, to = 0.0;  // beyond a bound: the bound and the error
  std::string what;             // of a fault
};

struct FamilySeriesReport {
  std::string name;
  std::vector<FamilyRun> runs;  // by n
  std::vector<FamilyMiss> misses;
  std::string left_out;  // which n, and why; empty: none
};

struct FamilyReport {
  std::string name, scene;
  std::vector<FamilyMeasure> measures;
  std::vector<FamilySeriesReport> series;
};

struct FamiliesReport {
  std::vector<FamilyReport> families;
  bool is_timed = true;

  // But for jumps of CPU time, which are told alone: a busy machine makes some.
  std::size_t misses() const;
};

// Neighbours differ by no more than this factor.
inline constexpr double kFamilyJump = 2.0;
// Less work than this per body and step (a microsecond, roughly) is not told apart.
inline constexpr double kLeastFamilyWork = 1000.0;
inline constexpr double kLeastFamilyTime_us = 1.0;

struct FamilyRequest {
  bool full = false;  // with Family::full_sizes
  // Its budget is for one scene: beyond it, this one and larger ones are left out.
  RepeatRule timing{.long_enough_s = 1.0, .budget_s = 60.0};
};

// In what the runs of a series (by n) do not keep to the law of their family.
std::vector<FamilyMiss> family_misses(const std::vector<FamilyMeasure>& measures,
                                      const std::vector<FamilyRun>& runs);

FamiliesReport measure_families(const std::vector<Family>& families, const FamilyRequest& request,
                                std::ostream& progress);

// A table for each series, its misses below.
std::string families_text(const FamiliesReport& report);
// One HTML file: of each family a diagram of each measure and of costs, over n. `command`: as it
// was typed.
std::string families_html(const FamiliesReport& report, const std::string& command);
// One object, keys as in docs/commands.md.
std::string families_json(const FamiliesReport& report);

}  // namespace soda::analysis
