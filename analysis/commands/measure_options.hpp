// The options of the commands that measure what anticipation and division buy, and their examples.
#pragma once

#include "analysis/commands/anticipation_command.hpp"
#include "analysis/commands/calibrate_command.hpp"
#include "analysis/commands/compare_command.hpp"
#include "analysis/commands/groups_command.hpp"
#include "analysis/commands/scaling_command.hpp"

namespace CLI {
class App;
}

namespace soda::analysis {

// Each outlives the command line's parsing.
void define_anticipation(CLI::App& command, AnticipationRequest& request);
void define_groups(CLI::App& command, GroupsRequest& request);
void define_scaling(CLI::App& command, ScalingRequest& request);
void define_compare(CLI::App& command, CompareRequest& request);
void define_calibrate(CLI::App& command, CalibrateRequest& request);

}  // namespace soda::analysis
