#include "analysis/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>

#include "analysis/anticipation_command.hpp"
#include "analysis/exit_codes.hpp"
#include "analysis/nearest_name.hpp"
#include "analysis/phold_command.hpp"
#include "analysis/plan_command.hpp"
#include "analysis/replay_command.hpp"
#include "analysis/run_command.hpp"
#include "analysis/shared_options.hpp"
#include "analysis/swarm_command.hpp"
#include "analysis/verify_command.hpp"
#include "analysis/version.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

bool mentions(int argc, const char* const* argv, std::string_view word) {
  return std::any_of(argv, argv + argc, [word](const char* argument) {
    return std::string_view(argument).starts_with(word);
  });
}

// What a command line mentions: options of anything else are not registered.
struct Wanted {
  bool in_real_time, balances, guesses;
};

CLI::App* add_run(CLI::App& app, RunRequest& request, const Wanted& wanted) {
  CLI::App* run = app.add_subcommand("run", "run a scenario; report error against run time");
  run->add_option("FILE", request.file, "scenario")->required();
  add_run_options(*run, request.overrides);
  add_rollback_option(*run, request.overrides);
  add_gating_option(*run, request.overrides);
  if (wanted.guesses) add_ghosts_option(*run, request.overrides);
  add_balancing_options(*run, request.overrides, wanted.balances);
  add_policy_option(*run, request.overrides.policy);
  add_cluster_options(*run, request.overrides.cluster, "modelled from its counters");
  run->add_option("--inputs", request.inputs,
                  "user input, one JSON object a line: a file, or - for standard input");
  run->add_option("--log", request.log_file, "write an event log for soda replay");
  run->add_flag_callback(
      "--realtime",
      [&request] {
        if (!request.real_time) request.real_time.emplace();
      },
      "show frames by the wall clock; report those on time, late, in slow motion");
  if (wanted.in_real_time) add_real_time_options(*run, request.real_time);
  run->add_flag("--json", request.json, "print one JSON object");
  run->add_flag("--step-digests", request.step_digests, "digest of every step");
  run->add_flag("--quiet", request.quiet, "no progress line");
  run->footer(
      "examples:\n"
      "  soda run scenarios/library/twelve-worlds.json\n"
      "  soda run scenarios/library/border-stack.json --threads 2 --worlds 4 --buffer 8\n"
      "  soda run scenarios/library/pyramid.json --steps 100 --json --log run.sodalog\n"
      "  soda run scenarios/library/twelve-worlds.json --executor virtual --latency-us 50\n"
      "  soda run scenarios/library/user-input.json --inputs more.jsonl\n"
      "  soda run scenarios/library/crowd.json --realtime --load 0.5 --peak 1.5\n"
      "  mpirun -n 2 soda run scenarios/library/twelve-worlds.json --executor mpi");
  return run;
}

CLI::App* add_plan(CLI::App& app, PlanRequest& request) {
  CLI::App* plan = app.add_subcommand("plan", "show what a run will use, and why");
  plan->add_option("FILE", request.file, "scenario")->required();
  add_run_options(*plan, request.overrides);
  add_balancing_options(*plan, request.overrides, true);
  plan->add_flag("--json", request.json, "print one JSON object");
  plan->footer("example:\n  soda plan scenarios/library/mixed-shapes.json --worlds 1");
  return plan;
}

CLI::App* add_replay(CLI::App& app, ReplayRequest& request) {
  CLI::App* replay =
      app.add_subcommand("replay", "re-run an event log and compare every step, or show a state");
  replay->add_option("LOG", request.file, "log written by soda run --log")->required();
  add_execution_options(*replay, request.overrides);
  replay->add_option("--scheduling-seed", request.overrides.scheduling_seed,
                     "threads executor: shuffle its scheduling (0: do not)");
  CLI::Option* step = replay->add_option("--step", request.step, "show the state after this step");
  replay->add_option("--body", request.body, "with --step: only this body, all digits")
      ->needs(step);
  replay->add_flag("--quiet", request.quiet, "no progress line");
  replay->footer(
      "examples:\n"
      "  soda replay run.sodalog\n"
      "  soda replay run.sodalog --threads 2 --worlds 48\n"
      "  soda replay run.sodalog --step 100 --body 7");
  return replay;
}

CLI::App* add_anticipation(CLI::App& app, AnticipationRequest& request) {
  AnticipationOptions& options = request.options;
  options.buffers = {12, 24, 48};
  options.overloads = {0.1, 0.25, 0.5, 1.0, 1.5};
  CLI::App* command = app.add_subcommand(
      "anticipation", "measure how long a transform buffer hides an overload (the paper's Fig. 8)");
  command->add_option("--buffers", options.buffers, "entries (default 12,24,48)")->delimiter(',');
  command
      ->add_option("--overloads", options.overloads,
                   "additional cost as a fraction (default 0.1,0.25,0.5,1,1.5)")
      ->delimiter(',');
  command->add_option("--utilisation", options.utilisation,
                      "base step cost over frame time (default 1)");
  command->add_option("--max-steps", options.max_steps, "give up after this many (default 2000)");
  command->add_flag("--json", request.json, "print one JSON object");
  command->add_option("-o,--output", request.svg_file, "draw the figure into this SVG file");
  command->footer("example:\n  soda anticipation --buffers 1,48 --overloads 0.5,1.5 -o fig8.svg");
  return command;
}

CLI::App* add_verify(CLI::App& app, VerifyRequest& request) {
  CLI::App* verify = app.add_subcommand(
      "verify", "check one trajectory: every executor against the plain loop, step by step");
  verify->add_option("FILE", request.file, "scenario")->required();
  verify->add_option("--steps", request.steps, "number of steps");
  verify->add_option("--threads", request.threads, "worker threads (default 1,2,4)")
      ->delimiter(',')
      ->check(CLI::Range(1u, 1024u));
  verify
      ->add_option("--worlds", request.worlds,
                   "territories (default 1,2,4,12,48), at most the number of cells")
      ->delimiter(',')
      ->check(CLI::Range(1u, 1u << 20));
  verify->add_option("--buffers", request.buffers, "buffer entries (default 1,4,48)")
      ->delimiter(',')
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  verify->add_option("--seeds", request.seeds, "scheduling seeds 1 to this (default 5)");
  verify->add_option("--random-inputs", request.random_inputs,
                     "seed of random user input beside the scenario's own");
  verify->add_flag("--require-rollbacks", request.require_rollbacks,
                   "fail if no run rolled back: then nothing was proved");
  verify->add_flag("--json", request.json, "print one JSON object");
  verify->footer(
      "examples:\n"
      "  soda verify scenarios/library/border-stack.json\n"
      "  soda verify scenarios/library/bin-1000.json --steps 10 --worlds 4,12 --seeds 1");
  return verify;
}

CLI::App* add_phold(CLI::App& app, PholdRequest& request) {
  CLI::App* phold = app.add_subcommand("phold", "benchmark of the kernel: events and no physics");
  kernel::StandardPholdOptions& model = request.model;
  for (const kernel::PholdConfiguration& configuration : kernel::phold_configurations()) {
    phold->add_flag_callback(
        std::string("--") + configuration.name,
        [&request, configuration] {
          request.model = configuration.model;
          request.end_units = configuration.end_units;
        },
        "the configuration of kernel/README.md (options after it change it)");
  }
  phold->add_option("--lps", model.lps, "logical processes (default 1024)")
      ->check(CLI::Range(1u, 1u << 26));
  phold->add_option("--start-events", model.start_events_per_lp, "per LP (default 1)")
      ->check(CLI::Range(0u, 1u << 20));
  phold->add_option("--remote", model.remote, "probability of a destination drawn from all LPs")
      ->check(CLI::Range(0.0, 1.0));
  phold
      ->add_option("--lookahead", model.least_delay,
                   "least delay L; a delay is L + Exp(1 - L) (default 0.1)")
      ->check(CLI::Range(0.0, 1.0));
  phold->add_option("--end", request.end_units, "virtual time (default 100)");
  phold->add_option("--seed", model.seed, "default 1");
  phold->add_option("--executor", request.executor, "sequential (default), threads, mpi or virtual")
      ->check(CLI::IsMember({"sequential", "threads", "mpi", "virtual"}));
  phold->add_option("--threads", request.threads, "worker threads, with --executor threads")
      ->check(CLI::Range(1u, 1024u));
  phold->add_option("--window", request.window_units, "virtual time beyond GVT (default: no limit)")
      ->check(CLI::NonNegativeNumber);
  add_policy_option(*phold, request.policy);
  add_cluster_options(*phold, request.cluster, "1");
  phold->add_flag("--order-sensitive", model.order_sensitive,
                  "the state of an LP depends on the order of its events");
  phold
      ->add_option("--zero-delay-rounds", model.zero_delay_rounds,
                   "hops without delay before each delay (default 0)")
      ->check(CLI::Range(0u, 1u << 20));
  phold->add_flag("--json", request.json, "print one JSON object");
  phold->footer(
      "examples:\n"
      "  soda phold --C1\n"
      "  soda phold --lps 16 --end 20000 --executor threads --threads 2 --window 1\n"
      "  soda phold --lps 64 --executor virtual --processors 8 --latency-us 5 --window 4");
  return phold;
}

CLI::App* add_swarm(CLI::App& app, SwarmRequest& request) {
  CLI::App* swarm = app.add_subcommand(
      "swarm", "random worlds, clusters and adversaries; every commit against the oracle");
  swarm->add_option("FILE", request.files, "scenarios (default: PHOLD)");
  swarm->add_option("--seeds", request.seeds, "FIRST..LAST (default 1..200)");
  swarm->add_option("--budget", request.budget_s, "start no trial after this many seconds")
      ->check(CLI::NonNegativeNumber);
  swarm->add_option("--steps", request.most_steps, "of a scenario, at most (default 20)")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  const std::string instead = "instead of what the seed draws: ";
  swarm->add_option("--lps", request.lps, instead + "LPs, or worlds")
      ->check(CLI::Range(1u, 1u << 16));
  swarm->add_option("--end", request.end, instead + "ticks, or steps")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  swarm->add_option("--window", request.window, instead + "window, or buffer")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  swarm->add_option("--processors", request.processors, instead + "virtual processors")
      ->check(CLI::Range(1u, 1u << 16));
  swarm->add_option("--decisions", request.decisions, instead + "the adversary's, none or a list");
  swarm->add_flag("--json", request.json, "print one JSON object");
  swarm->footer(
      "examples:\n"
      "  soda swarm --seeds 1..10000 --budget 600\n"
      "  soda swarm scenarios/library/third-world.json --seeds 1..100");
  return swarm;
}

std::vector<std::string> known_names(const CLI::App& app, const CLI::App* command) {
  std::vector<std::string> names;
  if (command == nullptr) {
    for (const CLI::App* subcommand : app.get_subcommands({})) {
      names.push_back(subcommand->get_name());
    }
  }
  for (const CLI::Option* option : (command == nullptr ? app : *command).get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

// CLI11's message, and the nearest known name if an argument is unknown.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const CLI::App* command = chosen.empty() ? nullptr : chosen.front();
  const std::string help =
      command == nullptr ? "soda --help" : "soda " + command->get_name() + " --help";
  const std::vector<std::string> unknown = app.remaining(true);
  if (unknown.empty()) return std::string(error.what()) + "\nsee " + help;
  const std::string name = unknown.front().substr(0, unknown.front().find('='));
  const std::string nearest = nearest_name(name, known_names(app, command));
  const char* kind =
      command == nullptr && name.rfind('-', 0) != 0 ? "unknown command " : "unknown argument ";
  return kind + name + (nearest.empty() ? "" : " (did you mean " + nearest + "?)") + "\nsee " +
         help;
}

}  // namespace

int run_command_line(int argc, const char* const* argv, kernel::Transport* transport,
                     std::ostream& out, std::ostream& err) {
  CLI::App app("Distributed, anticipative simulation of rigid bodies: SODA on Time Warp.", "soda");
  app.set_version_flag("--version", std::string("soda ") + kVersion);
  app.require_subcommand(1);
  app.footer(
      "exit codes: 0 ok, 1 a check failed, 2 usage or scenario, 3 files, 4 numerical "
      "failure\nsoda COMMAND --help shows options and examples");
  RunRequest run;
  PlanRequest plan;
  ReplayRequest replay;
  AnticipationRequest anticipation;
  VerifyRequest verify;
  PholdRequest phold;
  const bool all = mentions(argc, argv, "--help");
  const Wanted wanted{.in_real_time = all || mentions(argc, argv, "--realtime"),
                      .balances = all || mentions(argc, argv, "--balancing"),
                      .guesses = all || mentions(argc, argv, "--ghost")};
  const CLI::App* run_app = add_run(app, run, wanted);
  const CLI::App* plan_app = add_plan(app, plan);
  const CLI::App* replay_app = add_replay(app, replay);
  const CLI::App* anticipation_app = add_anticipation(app, anticipation);
  const CLI::App* verify_app = add_verify(app, verify);
  const CLI::App* phold_app = add_phold(app, phold);
  SwarmRequest swarm;
  const CLI::App* swarm_app = add_swarm(app, swarm);
  CLI::App* schema_app = app.add_subcommand("schema", "print the JSON Schema of scenario files");
  schema_app->footer("example:\n  soda schema > soda-scenario.schema.json");

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help, --version
    return app.exit(request, out, err);
  } catch (const CLI::ParseError& error) {
    throw UsageError(usage_message(app, error));
  }
  const bool for_jobs = run_app->parsed() || verify_app->parsed() || phold_app->parsed();
  if (transport != nullptr && !for_jobs)
    throw UsageError("started by mpirun; only run, verify and phold run over ranks");
  run.overrides.transport = verify.transport = phold.transport = transport;
  if (run_app->parsed()) return run_command(run, out, err);
  if (plan_app->parsed()) return plan_command(plan, out);
  if (replay_app->parsed()) return replay_command(replay, out, err);
  if (anticipation_app->parsed()) return anticipation_command(anticipation, out);
  if (verify_app->parsed()) return verify_command(verify, out);
  if (phold_app->parsed()) return phold_command(phold, out);
  if (swarm_app->parsed()) return swarm_command(swarm, out);
  out << scenarios::scenario_schema();
  return kExitOk;
}

}  // namespace soda::analysis
