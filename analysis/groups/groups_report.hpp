// What `soda groups` found, as tables, JSON, CSV and a page with diagrams.
#pragma once

#include <string>
#include <vector>

#include "analysis/groups/groups_run.hpp"
#include "analysis/groups/groups_sweep.hpp"

namespace soda::analysis {

struct SweepReport {
  std::string name;  // of the preset; empty: none
  SeedRange seeds;
  std::vector<SweepResult> results;  // series, each over bodies or over worlds
};

struct RunGroupsReport {
  std::string scenario;
  std::uint32_t worlds = 0;
  std::vector<BondOverTime> bonds;
};

// Points that differ from the first one in bodies only, or in worlds only, and come after it.
std::vector<std::vector<SweepResult>> series_of(const std::vector<SweepResult>& results);
// Whether it is a row that --check finds fault with.
bool is_off(const SweepResult& result);

std::string groups_text(const SweepReport& report);
std::string groups_text(const RunGroupsReport& report);
std::string groups_json(const SweepReport& report);
std::string groups_json(const RunGroupsReport& report);
std::string groups_csv(const SweepReport& report);
std::string groups_csv(const RunGroupsReport& report);
// `command`: as it was typed.
std::string groups_html(const SweepReport& report, const std::string& command);
std::string groups_html(const RunGroupsReport& report, const std::string& command);

}  // namespace soda::analysis
