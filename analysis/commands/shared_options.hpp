// Options that several commands share, or that belong together. Some are registered only if wanted:
// each costs every run about 33,000 instructions.
#pragma once

#include <optional>
#include <string>

#include "analysis/commands/run_command.hpp"
#include "analysis/runs/overrides.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace soda::analysis {

void add_strict_option(CLI::App& command, bool& strict);

void add_execution_options(CLI::App& command, Overrides& overrides);
void add_run_options(CLI::App& command, Overrides& overrides);
void add_rollback_option(CLI::App& command, Overrides& overrides);
void add_gating_option(CLI::App& command, Overrides& overrides);
void add_split_islands_option(CLI::App& command, Overrides& overrides);
void add_ghosts_option(CLI::App& command, Overrides& overrides);
// `in_full`: with those that only make sense beside --balancing.
void add_balancing_options(CLI::App& command, Overrides& overrides, bool in_full);
void add_policy_option(CLI::App& command, std::optional<kernel::Synchronisation>& policy);
void add_cluster_options(CLI::App& command, ClusterOverrides& cluster, const std::string& cost);
// All of these that say how worlds go about their work, and on what cluster: without ghosts if
// `extrapolates` is not set, balancing in full if `balances` is.
void add_world_options(CLI::App& command, Overrides& overrides, bool extrapolates, bool balances);
// In which form a command tells what it found.
struct ReportOptions {
  bool& json;
  bool& csv;
  std::string& page;  // HTML; empty: none
  bool& force;        // replaces it
};
void add_report_options(CLI::App& command, const ReportOptions& report);
// For numbers with a range: nan compares with no bound, so that a range lets it pass.
void refuse_nan(CLI::Option& option);
void add_real_time_options(CLI::App& command, std::optional<RealTimeRequest>& wanted);

}  // namespace soda::analysis
