// The options of each command, and its examples.
#pragma once

#include "analysis/commands/accuracy_command.hpp"
#include "analysis/commands/fuzz_command.hpp"
#include "analysis/commands/phold_command.hpp"
#include "analysis/commands/plan_command.hpp"
#include "analysis/commands/run_command.hpp"
#include "analysis/commands/swarm_command.hpp"
#include "analysis/commands/verify_command.hpp"

namespace CLI {
class App;
}

namespace soda::analysis {

// What a command line mentions: options of anything else are not registered.
struct Wanted {
  bool in_real_time, balances, extrapolates, strict;
};

// Each outlives the command line's parsing.
void define_run(CLI::App& run, RunRequest& request, const Wanted& wanted);
void define_plan(CLI::App& plan, PlanRequest& request);
void define_accuracy(CLI::App& command, AccuracyRequest& request);
void define_verify(CLI::App& verify, VerifyRequest& request);
void define_phold(CLI::App& phold, PholdRequest& request);
void define_fuzz(CLI::App& fuzz, FuzzRequest& request);
void define_swarm(CLI::App& swarm, SwarmRequest& request);

}  // namespace soda::analysis
