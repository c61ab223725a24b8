// What the page of `soda accuracy` begins with: who is how near at which cost.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/accuracy_command.hpp"

namespace soda::analysis {

// The largest of a run's errors, each over its must; none if the run has no result, or no measure a
// must. 0 over 0 counts as 0, any other error over 0, and what is no number, as infinite.
std::optional<double> largest_share_of_must(const CaseRun& run);

// Of one engine's runs of a case the cheapest that reaches every must; if none does, the one with
// the least share. Null if there is none.
const CaseRun* best_run(const AccuracyReport::Case& one, const std::string& engine);

// How an engine did over all cases in which something must be reached.
struct EngineSummary {
  std::string engine;
  std::size_t cases = 0;      // with a result
  std::size_t reached = 0;    // of these, every must by some run
  std::size_t cheapest = 0;   // of these, in less time than any other engine
  double median_cpu_s = 0.0;  // of the best runs of `reached`, per simulated second
  std::string worst_case;     // where its best run has the largest share of a must
  double worst_share = 0.0;
};
std::vector<EngineSummary> engine_summaries(const AccuracyReport& report);

// The table of engines, a picture of all best runs, what soda is farthest from, who reaches all
// bounds of a case in less time, and links to the cases.
std::string accuracy_summary_html(const AccuracyReport& report);

}  // namespace soda::analysis
