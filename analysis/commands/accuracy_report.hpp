// The forms of `soda accuracy`: text, and one HTML file.
#pragma once

#include <string>

#include "analysis/commands/accuracy_command.hpp"

namespace soda::analysis {

// "1/60" where the step is a whole fraction of a second, else a number.
std::string step_text(double dt_s);

// "1/60 s", and the tolerance where there is one.
std::string setting_text(const EngineSetting& setting);

// Whether any run of a case was in accuracy mode: then its tables have a column for it.
bool has_tolerances(const AccuracyReport::Case& one);

// A table for each case; measures over their must are marked, and counted at the end.
std::string accuracy_text(const AccuracyReport& report);

// The columns of a case's table: what has a bound, and all of references without bounds.
struct ErrorColumn {
  std::string form, measure, title;
  std::optional<double> must, stretch;
};
std::vector<ErrorColumn> error_columns(const AccuracyReport::Case& one);

// The observed order of convergence of every column, from the two finest steps of a series: of the
// runs up to `last`, those of its engine and iterations. Empty where there are not two, or an error
// is 0 or no number. Rounding errors have no order: what is below 1e-12 is left out, too.
std::vector<std::optional<double>> observed_orders(const AccuracyReport::Case& one,
                                                   std::size_t last,
                                                   const std::vector<ErrorColumn>& columns);

// Whether the next run belongs to another series.
bool ends_series(const AccuracyReport::Case& one, std::size_t run);

// A run of another engine that is nearer or cheaper than what soda offers: no run of soda has an
// error as small in as little time. Of measures with a bound; errors below 1e-12 are equal. Errors
// below 1e-3 first.
struct Advantage {
  std::string scene, measure, engine;  // measure: "" for all
  double dt_s = 0.0, error = 0.0, cpu_per_simulated_s = 0.0;
  std::optional<double> soda_cpu_per_simulated_s;  // least for as small an error, if reached at all
};
std::vector<Advantage> advantages_of_others(const AccuracyReport& report);

// The same over whole cases: no run of soda is as near in all measures with a bound in as little
// time. `error` is the largest of them.
std::vector<Advantage> advantages_in_cases(const AccuracyReport& report);

// The measure of a run under a column, or null.
const JudgedMeasure* find_measure(const CaseRun& run, const ErrorColumn& column);

}  // namespace soda::analysis
