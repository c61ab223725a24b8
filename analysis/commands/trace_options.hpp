// The options of the commands that look into event logs, and their examples.
#pragma once

#include "analysis/commands/branch_command.hpp"
#include "analysis/commands/contacts_command.hpp"
#include "analysis/commands/diff_command.hpp"
#include "analysis/commands/log_command.hpp"
#include "analysis/commands/replay_command.hpp"
#include "analysis/commands/trace_command.hpp"
#include "analysis/commands/view_command.hpp"
#include "analysis/trace/what_if_command.hpp"
#include "analysis/trace/why_command.hpp"

namespace CLI {
class App;
}

namespace soda::analysis {

// Each outlives the command line's parsing.
void define_replay(CLI::App& replay, ReplayRequest& request);
void define_view(CLI::App& view, ViewRequest& request);
void define_log(CLI::App& command, LogRequest& request);
void define_why(CLI::App& command, WhyRequest& request);
void define_what_if(CLI::App& command, WhatIfRequest& request);
void define_branch(CLI::App& command, BranchRequest& request);
void define_trace(CLI::App& command, TraceRequest& request);
void define_diff(CLI::App& diff, DiffRequest& request);
void define_contacts(CLI::App& command, ContactsRequest& request);

}  // namespace soda::analysis
