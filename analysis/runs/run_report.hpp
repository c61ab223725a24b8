// What `soda run` reports, and its readable form.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/realtime.hpp"
#include "analysis/runs/warnings.hpp"

namespace soda::analysis {

// Of a log's run again.
struct ReplayOutcome {
  std::string log;
  std::optional<std::string> divergence;  // the first one
};

struct RunReport {
  std::string scenario;
  std::vector<std::uint32_t> labels;  // by which the user knows the bodies
  std::size_t bodies = 0;
  std::uint32_t worlds = 1;
  double dt_s = 0.0;
  models::RunOptions options;
  MeasuredRun run;
  bool with_step_digests = false;
  std::vector<std::uint64_t> step_digests;       // of the states after step 1, 2, ...
  std::optional<std::int64_t> one_processor_ns;  // see undivided_run.hpp
  std::optional<RealTimeReport> real_time;
  FileWarnings warnings;
  std::optional<ReplayOutcome> replay;
};

// What is known of a run beforehand; `file` is that of the scenario.
RunReport report_of(const scenarios::Scenario& scenario, const std::string& file);

// Several tables; every figure with its unit.
std::string run_text(const RunReport& report);

// What islands that joints alone hold together will cost (models/cost/joint_cost.hpp), the
// costliest first, with each what it means in words.
struct JointIslandFigures {
  std::vector<std::map<std::string, std::uint64_t>> counts;
  std::vector<std::string> words;
};
JointIslandFigures joint_island_figures(const physics::SceneDescription& scene);

// Who tests each pair of shapes that can meet: a kernel, and FCL or own code.
std::string shape_pairs_text(const physics::SceneDescription& scene);

// Of the joint islands, as text: a line for each costly one, else one for the costliest; nothing
// without joints between bodies.
std::string joint_costs_text(const physics::SceneDescription& scene);

// A plan as a table; with `counters` (one per line) a column of what was counted.
std::string plan_text(const std::vector<models::PlanLine>& plan,
                      const std::vector<std::uint64_t>* counters);

// What a virtual cluster's clock and network say, and where its processors' time has gone, as
// tables.
std::string cluster_text(const kernel::VirtualReport& cluster,
                         std::optional<std::int64_t> one_processor_ns);

// The terms of the account by name, in the order in which they are told.
std::vector<std::pair<std::string, std::int64_t>> account_terms(const kernel::TimeAccount& account);

// The same as a table, with the sum in a last line of that name; and as a line, in percent.
std::string account_text(const kernel::TimeAccount& account, const std::string& sum_name);
std::string account_line(const kernel::TimeAccount& account);

// Rates that reports share; 0 for a run that took no time.
double steps_per_second(const MeasuredRun& run);
double real_time_factor(const MeasuredRun& run, double dt_s);  // simulated time over wall time

double cluster_utilisation(const kernel::VirtualReport& cluster);  // busy over all time

}  // namespace soda::analysis
