// Synchronisation groups over the steps of a run.
#pragma once

#include <cstdint>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/groups/groups_sweep.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

struct StepGroups {
  std::int64_t step = 0;  // from the state after `step` steps to the next
  GroupShares shares{};
  double largest = 0.0;  // share of the worlds in the largest group
};

struct BondOverTime {
  GroupBond bond = GroupBond::kOverlap;
  std::vector<StepGroups> steps;  // all of the run, in order
};

// Of a log with all states, and with a trace if rollbacks are asked for. Owners are those that the
// map gives, before the step's inputs act. Boxes are those that worlds test against borders: swept,
// with what a contact needs. Rollbacks bond a world that rolled back for this step with each world
// whose late message led to it.
std::vector<BondOverTime> groups_of_run(LogReader& log, const scenarios::Scenario& scenario,
                                        const std::vector<GroupBond>& bonds);

// Mean over steps first .. end - 1 of them, which are there.
StepGroups mean_of_steps(const BondOverTime& bond, std::size_t first, std::size_t end);

}  // namespace soda::analysis
