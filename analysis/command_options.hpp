// The options of each command, and its examples.
#pragma once

#include "analysis/accuracy_command.hpp"
#include "analysis/anticipation/anticipation_command.hpp"
#include "analysis/fuzz_command.hpp"
#include "analysis/groups/groups_command.hpp"
#include "analysis/phold_command.hpp"
#include "analysis/plan_command.hpp"
#include "analysis/rollback_command.hpp"
#include "analysis/run_command.hpp"
#include "analysis/scaling/scaling_command.hpp"
#include "analysis/swarm_command.hpp"
#include "analysis/verify_command.hpp"

namespace CLI {
class App;
}

namespace soda::analysis {

// What a command line mentions: options of anything else are not registered.
struct Wanted {
  bool in_real_time, balances, guesses, strict;
};

// Each outlives the command line's parsing.
void define_run(CLI::App& run, RunRequest& request, const Wanted& wanted);
void define_plan(CLI::App& plan, PlanRequest& request);
void define_accuracy(CLI::App& command, AccuracyRequest& request);
void define_anticipation(CLI::App& command, AnticipationRequest& request);
void define_groups(CLI::App& command, GroupsRequest& request);
void define_verify(CLI::App& verify, VerifyRequest& request);
void define_rollback(CLI::App& rollback, RollbackRequest& request);
void define_scaling(CLI::App& command, ScalingRequest& request);
void define_phold(CLI::App& phold, PholdRequest& request);
void define_fuzz(CLI::App& fuzz, FuzzRequest& request);
void define_swarm(CLI::App& swarm, SwarmRequest& request);

}  // namespace soda::analysis
