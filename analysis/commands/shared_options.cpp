#include "analysis/commands/shared_options.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <map>

namespace soda::analysis {
namespace {

using Executor = models::ExecutorKind;

}  // namespace

void add_execution_options(CLI::App& command, Overrides& overrides) {
  const std::map<std::string, Executor> executors = {{"sequential", Executor::kSequential},
                                                     {"threads", Executor::kThreads},
                                                     {"mpi", Executor::kMpi},
                                                     {"virtual", Executor::kVirtual}};
  command
      .add_option_function<std::string>(
          "--executor",
          [&overrides, executors](const std::string& name) {
            overrides.executor = executors.at(name);
          },
          "sequential, threads, mpi or virtual (default: the scenario's)")
      ->check(CLI::IsMember(executors));
  command
      .add_option("--threads", overrides.threads,
                  "worker threads (of each rank), at least 1; selects the threads executor")
      ->check(CLI::Range(1u, 1024u));
  command.add_option("--worlds", overrides.worlds, "territories, 1 to the number of cells");
  command.add_option("--buffer", overrides.buffer, "entries of each world's transform buffer");
}

void add_run_options(CLI::App& command, Overrides& overrides) {
  add_execution_options(command, overrides);
  command.add_option("--steps", overrides.steps, "number of steps");
  command.add_option("--seed", overrides.seed, "replaces every seed of the scenario");
  command.add_option("--scheduling-seed", overrides.scheduling_seed,
                     "threads executor: shuffle its scheduling (0: do not)");
}

void add_rollback_option(CLI::App& command, Overrides& overrides) {
  const std::map<std::string, models::RollbackMode> modes = {
      {"propagate", models::RollbackMode::kPropagate},
      {"invalidate", models::RollbackMode::kInvalidate},
      {"warm", models::RollbackMode::kWarm}};
  command
      .add_option_function<std::string>(
          "--rollback",
          [&overrides, modes](const std::string& name) { overrides.rollback = modes.at(name); },
          "propagate (default): re-executed steps compute only what changed; invalidate: all; "
          "warm: "
          "what changed, from earlier multipliers, so that bits depend on history")
      ->check(CLI::IsMember(modes));
}

void add_gating_option(CLI::App& command, Overrides& overrides) {
  const std::map<std::string, bool> modes = {{"on", true}, {"off", false}};
  command
      .add_option_function<std::string>(
          "--gating",
          [&overrides, modes](const std::string& name) { overrides.gating = modes.at(name); },
          "on (default): worlds whose bodies touch wait for each other; off: nobody waits")
      ->check(CLI::IsMember(modes));
}

void add_split_islands_option(CLI::App& command, Overrides& overrides) {
  const std::map<std::string, bool> modes = {{"on", true}, {"off", false}};
  command
      .add_option_function<std::string>(
          "--split-islands",
          [&overrides, modes](const std::string& name) {
            overrides.split_islands = modes.at(name);
          },
          "on (default): of a giant island over several processors each solves a part; off: each "
          "solves the whole")
      ->check(CLI::IsMember(modes));
}

void add_ghosts_option(CLI::App& command, Overrides& overrides) {
  const std::map<std::string, models::GhostMode> modes = {
      {"told", models::GhostMode::kReceivedOnly},
      {"dead-reckoning", models::GhostMode::kDeadReckoning},
      {"predicted", models::GhostMode::kPredicted}};
  command
      .add_option_function<std::string>(
          "--ghosts",
          [&overrides, modes](const std::string& name) { overrides.ghosts = modes.at(name); },
          "foreign bodies that a world has not been told of yet in a step: told (default): it "
          "ignores them; dead-reckoning: they go on with constant velocity; predicted: they are "
          "where they will be if nothing touches them")
      ->check(CLI::IsMember(modes));
}

void add_balancing_options(CLI::App& command, Overrides& overrides, bool in_full) {
  const std::map<std::string, models::BalancingPolicy> policies = {
      {"off", models::BalancingPolicy::kOff},
      {"paper", models::BalancingPolicy::kPaper},
      {"random", models::BalancingPolicy::kRandom}};
  command
      .add_option_function<std::string>(
          "--balancing",
          [&overrides, policies](const std::string& name) {
            overrides.balancing = policies.at(name);
          },
          "off (default); paper: cells go from loaded worlds to neighbours; random: for tests")
      ->check(CLI::IsMember(policies));
  if (!in_full) return;
  command.add_option("--balancing-interval", overrides.balancing_interval,
                     "steps between decisions (default 10)");
  command.add_option("--balancing-seed", overrides.balancing_seed, "of random (default 1)");
}

void add_policy_option(CLI::App& command, std::optional<kernel::Synchronisation>& policy) {
  const std::map<std::string, kernel::Synchronisation> policies = {
      {"optimistic", kernel::Synchronisation::kOptimistic},
      {"lockstep", kernel::Synchronisation::kLockstep}};
  command
      .add_option_function<std::string>(
          "--policy", [&policy, policies](const std::string& name) { policy = policies.at(name); },
          "optimistic (default), or lockstep: nobody runs ahead")
      ->check(CLI::IsMember(policies));
}

// `cost`: what an event costs if nothing is said of it.
void add_cluster_options(CLI::App& command, ClusterOverrides& cluster, const std::string& cost) {
  command.add_option("--processors", cluster.processors,
                     "virtual processors (default: one for each world or LP)");
  command.add_option("--latency-us", cluster.latency_us, "of a message (default 10)");
  command.add_option("--jitter-us", cluster.jitter_us, "more latency, up to this (default 0)");
  command.add_option("--bandwidth-mb-s", cluster.bandwidth_mb_s, "of a processor (default: any)");
  command.add_option("--cost-us", cluster.cost_us, "of an event (default: " + cost + ")");
  command.add_option("--gvt-interval-us", cluster.gvt_interval_us, "(default 100)");
  command.add_option("--execution-seed", cluster.execution_seed, "of the jitter (default 0)");
  command.add_flag("--check-purity", cluster.check_purity, "execute every event twice and compare");
}

void add_strict_option(CLI::App& command, bool& strict) {
  command.add_flag("--strict", strict, "warnings of a scenario are errors: exit 2, nothing is run");
}

void add_world_options(CLI::App& command, Overrides& overrides, bool extrapolates, bool balances) {
  add_rollback_option(command, overrides);
  add_gating_option(command, overrides);
  add_split_islands_option(command, overrides);
  if (extrapolates) add_ghosts_option(command, overrides);
  add_balancing_options(command, overrides, balances);
  add_policy_option(command, overrides.policy);
  add_cluster_options(command, overrides.cluster, "modelled from its counters");
}

void add_report_options(CLI::App& command, const ReportOptions& report) {
  CLI::Option* const json = command.add_flag("--json", report.json, "print one JSON object");
  command.add_flag("--csv", report.csv, "a table with a line of names")->excludes(json);
  command.add_option("-o,--output", report.page, "write an HTML page with pictures");
  command.add_flag("--force", report.force, "replace the page if it exists");
}

void refuse_nan(CLI::Option& option) {
  option.check([](const std::string& text) {
    const bool number = !std::isnan(std::strtod(text.c_str(), nullptr));
    return number ? std::string() : "found " + text + "; allowed: a number";
  });
}

// Only with --realtime or --help: what an option costs each run is counted (tests/analysis,
// RunCost).
void add_real_time_options(CLI::App& command, std::optional<RealTimeRequest>& wanted) {
  const auto add = [&](const char* name, auto member, double least, double most, const char* help) {
    refuse_nan(*command
                    .add_option_function<double>(
                        name,
                        [&wanted, member](const double& value) {
                          if (!wanted) wanted.emplace();
                          member(*wanted) = value;
                        },
                        help)
                    ->check(CLI::Range(least, most)));
  };
  add(
      "--fps", [](RealTimeRequest& r) -> double& { return r.frames_per_s; }, 0.1, 1000.0,
      "frames a second (default 60)");
  add(
      "--speed", [](RealTimeRequest& r) -> double& { return r.speed; }, 1e-3, 1e3,
      "simulated time over wall time (default 1)");
  add(
      "--load", [](RealTimeRequest& r) -> double& { return r.load; }, 0.0, 100.0,
      "artificial CPU time a step, over the wall time that it has (default 0)");
  add(
      "--peak", [](RealTimeRequest& r) -> double& { return r.peak; }, 0.0, 100.0,
      "the same during the peak (default: no peak)");
  add(
      "--peak-from", [](RealTimeRequest& r) -> double& { return r.peak_from_s; }, 0.0, 1e6,
      "seconds after the first frame (default 2)");
  add(
      "--lead", [](RealTimeRequest& r) -> double& { return r.lead_frames.emplace(); }, 1.0, 1e6,
      "frames that GVT may be beyond what is shown (default: 2, and as many more as it needs)");
  add(
      "--peak-for", [](RealTimeRequest& r) -> double& { return r.peak_for_s; }, 0.0, 1e6,
      "seconds (default 1)");
}

}  // namespace soda::analysis
