#include "analysis/commands/command_options.hpp"

#include <CLI/CLI.hpp>

#include "analysis/commands/shared_options.hpp"

namespace soda::analysis {

void define_run(CLI::App& run, RunRequest& request, const Wanted& wanted) {
  auto* const file = run.add_option("FILE", request.file, "scenario");
  run.add_option("--resume", request.resume,
                 "go on from a checkpoint, or from the last states of an event log")
      ->excludes(file);
  add_run_options(run, request.overrides);
  add_world_options(run, request.overrides, wanted.extrapolates, wanted.balances);
  run.add_option("--inputs", request.inputs,
                 "user input, one JSON object a line: a file, or - for standard input");
  run.add_option("--log", request.log_file, "write an event log for soda replay");
  run.add_option_function<std::string>(
         "--log-level",
         [&request](const std::string& name) {
           request.log_level = LogLevel(std::ranges::find(kLogLevels, name) - kLogLevels.begin());
         },
         "commits (default): all states; inputs: what a replay needs; trace: the life of every "
         "event, too")
      ->check(CLI::IsMember(std::vector<std::string>(kLogLevels.begin(), kLogLevels.end())));
  run.add_option("--log-every", request.log_every, "states of every Kth step only")
      ->check(CLI::PositiveNumber);
  run.add_option("--view", request.view_file, "write a page to look at the run in a browser");
  auto* const checkpoint = run.add_option("--checkpoint", request.checkpoint_file,
                                          "write checkpoints, each over the one before");
  run.add_option("--every", request.checkpoint_every,
                 "steps between checkpoints (default 1000); one is written at the end, too")
      ->check(CLI::PositiveNumber)
      ->needs(checkpoint);
  run.add_flag("--force", request.force, "replace log, page and checkpoint if they exist");
  run.add_flag_callback(
      "--realtime",
      [&request] {
        if (!request.real_time) request.real_time.emplace();
      },
      "show frames by the wall clock; report those on time, late, in slow motion");
  if (wanted.in_real_time) add_real_time_options(run, request.real_time);
  run.add_flag("--json", request.json, "print one JSON object");
  run.add_flag("--step-digests", request.step_digests, "digest of every step");
  run.add_flag("--quiet", request.quiet, "no progress line");
  if (wanted.strict) add_strict_option(run, request.overrides.strict);
  run.footer(
      "examples:\n"
      "  soda run scenarios/library/twelve-worlds.json\n"
      "  soda run scenarios/library/border-stack.json --threads 2 --worlds 4 --buffer 8\n"
      "  soda run scenarios/library/pyramid.json --steps 100 --json --log run.sodalog\n"
      "  soda run scenarios/library/border-stack.json --log run.sodalog --log-level trace\n"
      "  soda run scenarios/library/crowd.json --view crowd.html\n"
      "  soda run scenarios/library/crowd.json --checkpoint crowd.sodapoint --every 100\n"
      "  soda run --resume crowd.sodapoint --threads 2\n"
      "  soda run scenarios/library/twelve-worlds.json --executor virtual --latency-us 50\n"
      "  soda run scenarios/library/user-input.json --inputs more.jsonl\n"
      "  soda run scenarios/library/crowd.json --realtime --load 0.5 --peak 1.5\n"
      "  mpirun -n 2 soda run scenarios/library/twelve-worlds.json --executor mpi");
}

void define_plan(CLI::App& plan, PlanRequest& request) {
  plan.add_option("FILE", request.file, "scenario")->required();
  add_run_options(plan, request.overrides);
  add_balancing_options(plan, request.overrides, true);
  plan.add_flag("--json", request.json, "print one JSON object");
  add_strict_option(plan, request.overrides.strict);
  plan.footer("example:\n  soda plan scenarios/library/mixed-shapes.json --worlds 1");
}

void define_accuracy(CLI::App& command, AccuracyRequest& request) {
  command.add_option("CASE", request.cases, "names in the folder, or files (default: all)");
  command.add_option("--cases", request.folder, "their folder (default scenarios/cases)");
  command.add_option("--dt", request.steps_s, "steps in s, as 1/60,1/240 (default: the case's)")
      ->delimiter(',');
  command.add_flag("--sweep", request.sweep, "and the last of them halved four times");
  command
      .add_option("--tolerance", request.tolerances,
                  "run soda in accuracy mode, as 1e-4,1e-6; beside --dt, if given, or instead")
      ->delimiter(',');
  command.add_option("--iterations", request.iterations, "of the contact solver")->delimiter(',');
  command
      .add_option("--engines", request.engines,
                  "soda (default), soda-fast, soda-accurate, soda-fcl, soda-own, bullet, ode, "
                  "mujoco")
      ->delimiter(',');
  command.add_option("--repeat", request.timing.repeats,
                     "timed runs, of which the median counts (default 3; 0: no timing)");
  refuse_nan(*command
                  .add_option("--budget", request.timing.budget_s,
                              "leave out settings beyond this many CPU seconds (default 60)")
                  ->check(CLI::NonNegativeNumber));
  command.add_flag("--extremes", request.extremes,
                   "a box at rest instead, over all sizes, steps, offsets and masses");
  command.add_flag("--families", request.families,
                   "scenes over n instead: rows, stacks, piles, chains, stars, grids; CASE: names");
  command.add_flag("--full", request.full,
                   "with --families: up to the largest n; without, --budget is 3 at most");
  command.add_flag("--check", request.check, "exit 1 if soda misses what it must reach");
  command.add_flag("--json", request.json, "print one JSON object");
  command.add_option("-o,--output", request.html_file, "write tables and diagrams, one HTML file");
  command.add_flag("--force", request.force, "replace it if it exists");
  add_strict_option(command, request.strict);
  command.footer(
      "examples:\n"
      "  soda accuracy free-fall bounce\n"
      "  soda accuracy slip-0 --sweep -o slip.html\n"
      "  soda accuracy arch chain --engines soda,soda-fast,soda-accurate\n"
      "  soda accuracy tip stop --tolerance 1e-3,1e-6,1e-9\n"
      "  soda accuracy --dt 1/60,1/240 --engines soda,bullet,ode --json\n"
      "  soda accuracy spin --check\n"
      "  soda accuracy --extremes\n"
      "  soda accuracy --families stack star --check\n"
      "  soda accuracy --families --full -o families.html");
}

void define_verify(CLI::App& verify, VerifyRequest& request) {
  verify.add_option("FILE", request.file, "scenario")->required();
  verify.add_option("--steps", request.steps, "number of steps");
  verify.add_option("--threads", request.threads, "worker threads (default 1,2,4)")
      ->delimiter(',')
      ->check(CLI::Range(1u, 1024u));
  verify
      .add_option("--worlds", request.worlds,
                  "territories (default 1,2,4,12,48), at most the number of cells")
      ->delimiter(',')
      ->check(CLI::Range(1u, 1u << 20));
  verify.add_option("--buffers", request.buffers, "buffer entries (default 1,4,48)")
      ->delimiter(',')
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  verify.add_option("--seeds", request.seeds,
                    "scheduling seeds 0, the schedule of soda run, to this (default 5)");
  verify.add_flag("--all-modes", request.all_modes,
                  "each seed with every rollback mode, gating, ghosts and balancing; else by seed");
  verify.add_option("--random-inputs", request.random_inputs,
                    "seed of random user input beside the scenario's own");
  verify.add_flag("--require-rollbacks", request.require_rollbacks,
                  "fail if no run rolled back: then nothing was proved");
  verify.add_flag("--json", request.json, "print one JSON object");
  add_strict_option(verify, request.strict);
  verify.footer(
      "examples:\n"
      "  soda verify scenarios/library/border-stack.json\n"
      "  soda verify scenarios/library/bin-1000.json --steps 10 --worlds 4,12 --seeds 1");
}

void define_phold(CLI::App& phold, PholdRequest& request) {
  kernel::StandardPholdOptions& model = request.model;
  for (const kernel::PholdConfiguration& configuration : kernel::phold_configurations()) {
    phold.add_flag_callback(
        std::string("--") + configuration.name,
        [&request, configuration] {
          request.model = configuration.model;
          request.end_units = configuration.end_units;
        },
        "the configuration of kernel/README.md (options after it change it)");
  }
  phold.add_option("--lps", model.lps, "logical processes (default 1024)")
      ->check(CLI::Range(1u, 1u << 26));
  phold.add_option("--start-events", model.start_events_per_lp, "per LP (default 1)")
      ->check(CLI::Range(0u, 1u << 20));
  refuse_nan(
      *phold
           .add_option("--remote", model.remote, "probability of a destination drawn from all LPs")
           ->check(CLI::Range(0.0, 1.0)));
  refuse_nan(*phold
                  .add_option("--lookahead", model.least_delay,
                              "least delay L; a delay is L + Exp(1 - L) (default 0.1)")
                  ->check(CLI::Range(0.0, 1.0)));
  phold.add_option("--end", request.end_units, "virtual time (default 100)");
  phold.add_option("--seed", model.seed, "default 1");
  phold.add_option("--executor", request.executor, "sequential (default), threads, mpi or virtual")
      ->check(CLI::IsMember({"sequential", "threads", "mpi", "virtual"}));
  phold.add_option("--threads", request.threads, "worker threads, with --executor threads")
      ->check(CLI::Range(1u, 1024u));
  phold.add_option("--window", request.window_units, "virtual time beyond GVT (default: no limit)")
      ->check(CLI::NonNegativeNumber);
  add_policy_option(phold, request.policy);
  add_cluster_options(phold, request.cluster, "1");
  phold.add_flag("--order-sensitive", model.order_sensitive,
                 "the state of an LP depends on the order of its events");
  phold
      .add_option("--zero-delay-rounds", model.zero_delay_rounds,
                  "hops without delay before each delay (default 0)")
      ->check(CLI::Range(0u, 1u << 20));
  phold.add_flag("--json", request.json, "print one JSON object");
  phold.footer(
      "examples:\n"
      "  soda phold --C1\n"
      "  soda phold --lps 16 --end 20000 --executor threads --threads 2 --window 1\n"
      "  soda phold --lps 64 --executor virtual --processors 8 --latency-us 5 --window 4");
}

namespace {

// Searches of `soda fuzz` that run whole scenarios.
void define_whole(CLI::App& fuzz, FuzzRequest& request) {
  CLI::Option* const whole =
      fuzz.add_flag("--whole", request.is_whole,
                    "whole scenarios instead, run by the program with any executor and compared "
                    "with the plain loop");
  CLI::Option* const continuity =
      fuzz.add_flag("--continuity", request.is_continuity,
                    "changes of whole scenarios that should not matter to what they do not concern")
          ->excludes(whole);
  fuzz.add_option("--jobs", request.jobs,
                  "of --whole and --continuity: seeds at a time (default 1)")
      ->check(CLI::Range(1u, 1024u));
  fuzz.add_option("--executors", request.whole.executors,
                  "with --whole: of default, sequential, threads, mpi and virtual (default: all)")
      ->delimiter(',')
      ->needs(whole);
  fuzz.add_option("--program", request.whole.program, "with --whole: another soda")->needs(whole);
  refuse_nan(*fuzz.add_option("--patience", request.whole.patience_s,
                              "with --whole: seconds of processor time that a run may take, beside "
                              "300 times what the plain loop takes (default 20)")
                  ->check(CLI::PositiveNumber)
                  ->needs(whole));
  fuzz.add_option(
          "--kinds", request.continuity.kinds,
          "with --continuity: of tiny-force, far-body, far-contact, far-joint, far-spring, "
          "far-input, unused-material, unused-drive, default-key, longer-row (default: all)")
      ->delimiter(',')
      ->needs(continuity);
}

}  // namespace

void define_fuzz(CLI::App& fuzz, FuzzRequest& request) {
  fuzz.add_option("FILE", request.files, "scenarios to check (default: random scenes)");
  fuzz.add_option("--seeds", request.seeds, "FIRST..LAST (default 1..200)");
  refuse_nan(
      *fuzz.add_option("--budget", request.budget_s, "start no trial after this many seconds")
           ->check(CLI::NonNegativeNumber));
  fuzz.add_option("--steps", request.steps, "of a random scene (default 60)")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  CLI::Option* const joints =
      fuzz.add_flag("--joints", request.joints, "with joints, limits and motors in every one");
  fuzz.add_flag("--springs", request.springs, "with springs in every one")->excludes(joints);
  fuzz.add_option("--failures", request.most_failures, "stop after this many (default 1)")
      ->check(CLI::Range(1u, 1u << 20));
  fuzz.add_option("--shrinking", request.most_shrinking, "trials for each failure (default 400)")
      ->check(CLI::Range(0u, 1u << 20));
  fuzz.add_option("-o,--output", request.folder, "folder for the shrunk scenarios");
  fuzz.add_flag("--json", request.json, "print one JSON object");
  add_strict_option(fuzz, request.strict);
  define_whole(fuzz, request);
  fuzz.footer(
      "examples:\n"
      "  soda fuzz --whole --seeds 1..10000 --jobs 2 --failures 50 -o /tmp/found\n"
      "  soda fuzz --whole --seeds 1..500 --program build/asan/soda --patience 200\n"
      "  soda fuzz --continuity --seeds 1..1000 --jobs 2 --failures 1000\n"
      "  soda fuzz --seeds 1..10000 --failures 50 -o /tmp\n"
      "  soda fuzz --seeds 17..17 --steps 600\n"
      "  soda fuzz /tmp/fuzz-17.json");
}

void define_swarm(CLI::App& swarm, SwarmRequest& request) {
  swarm.add_option("FILE", request.files, "scenarios (default: PHOLD)");
  swarm.add_option("--seeds", request.seeds, "FIRST..LAST (default 1..200)");
  refuse_nan(
      *swarm.add_option("--budget", request.budget_s, "start no trial after this many seconds")
           ->check(CLI::NonNegativeNumber));
  swarm.add_option("--steps", request.most_steps, "of a scenario, at most (default 20)")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  const std::string instead = "instead of what the seed draws: ";
  swarm.add_option("--lps", request.lps, instead + "LPs, or worlds")
      ->check(CLI::Range(1u, 1u << 16));
  swarm.add_option("--end", request.end, instead + "ticks, or steps")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  swarm.add_option("--window", request.window, instead + "window, or buffer")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 20));
  swarm.add_option("--processors", request.processors, instead + "virtual processors")
      ->check(CLI::Range(1u, 1u << 16));
  swarm.add_option("--decisions", request.decisions, instead + "the adversary's, none or a list");
  swarm.add_flag("--json", request.json, "print one JSON object");
  add_strict_option(swarm, request.strict);
  swarm.footer(
      "examples:\n"
      "  soda swarm --seeds 1..10000 --budget 600\n"
      "  soda swarm scenarios/library/third-world.json --seeds 1..100");
}

}  // namespace soda::analysis
