#include "analysis/commands/measure_options.hpp"

#include <CLI/CLI.hpp>

#include "analysis/commands/shared_options.hpp"

namespace soda::analysis {

void define_anticipation(CLI::App& command, AnticipationRequest& request) {
  AnticipationOptions& options = request.options;
  options.buffers = {12, 24, 48};
  options.overloads = {0.1, 0.25, 0.5, 1.0, 1.5};
  command.add_option("FILE", request.file, "scenario (default: worlds in which nothing happens)");
  command.add_option("--buffers", options.buffers, "entries (default 12,24,48)")->delimiter(',');
  command
      .add_option("--overloads", options.overloads,
                  "additional cost as a fraction (default 0.1,0.25,0.5,1,1.5)")
      ->delimiter(',');
  command
      .add_option("--mode", request.mode,
                  "modelled (default): on the virtual cluster; measured: by the wall clock; all; "
                  "law: neither")
      ->check(CLI::IsMember({"modelled", "measured", "law", "all"}));
  command.add_option("--peak", request.peak,
                     "who is overloaded when: WORLDS@FROM[+FOR] in s, or random:SEED "
                     "(default all@1)");
  command.add_option("--utilisation", options.utilisation,
                     "base step cost over the time that a step has (default 1)");
  command.add_option("--fps", options.frames_per_s, "frames a second (default 60)");
  command.add_option("--speed", options.speed, "simulated over shown time (default 1)");
  command.add_option(
      "--lead", options.lead_frames,
      "measured: frames that GVT may be beyond what is shown (default: 2, and as many "
      "more as it needs)");
  command.add_option("--repeat", options.repeat, "measured runs of which the median counts");
  command.add_option("--steps", request.overrides.steps,
                     "over makespan: of each run (default: the scenario's)");
  command.add_option("--max-steps", options.max_steps, "give up after this many (default 600)");
  command
      .add_option("--over",
                  "frames (default): until one is late; makespan: of runs without a clock")
      ->check(CLI::IsMember({"frames", "makespan"}))
      ->each([&request](const std::string& what) { request.over_makespan = what == "makespan"; });
  command.add_option("--preset", "paper-fig8: the paper's figure")
      ->check(CLI::IsMember({"paper-fig8"}))
      ->each([&request](const std::string&) { request.paper = true; });
  add_execution_options(command, request.overrides);
  add_world_options(command, request.overrides, true, true);
  add_report_options(command, {request.json, request.csv, request.report_file, request.force});
  command.add_flag("--quiet", request.quiet, "no progress line");
  command.footer(
      "examples:\n"
      "  soda anticipation --preset paper-fig8 --mode all -o fig8.html\n"
      "  soda anticipation --worlds 3 --threads 2 --mode measured --peak 1@1\n"
      "  soda anticipation scenarios/library/crowd.json --overloads 0.5 --peak 0,1@2+1\n"
      "  soda anticipation scenarios/library/crowd.json --over makespan --steps 300");
}

void define_groups(CLI::App& command, GroupsRequest& request) {
  command.add_option("FILE", request.file, "scenario to run (default: the paper's scene, no run)");
  command.add_option("--by", request.by, "overlap (default), contact, rollbacks, all (of a FILE)")
      ->delimiter(',')
      ->check(CLI::IsMember({"overlap", "contact", "rollbacks", "all"}));
  command.add_option("--bodies", request.bodies, "(default 500)")->delimiter(',');
  command.add_option("--worlds", request.worlds, "(default 12; of a FILE its own)")->delimiter(',');
  command.add_option("--map", request.maps, "paper, blocks (default both)")
      ->delimiter(',')
      ->check(CLI::IsMember({"paper", "blocks"}));
  command.add_option("--seeds", request.seeds, "FIRST..LAST (default 1..20)");
  command.add_option("--preset", request.preset, "paper-fig6, paper-fig7 or threshold")
      ->check(CLI::IsMember({"paper-fig6", "paper-fig7", "threshold"}));
  command.add_flag("--check", request.check, "exit 1 if a share is off by more than 5 points");
  command.add_option("--steps", request.steps, "of a FILE");
  add_report_options(command, {request.json, request.csv, request.page_file, request.force});
  command.footer(
      "examples:\n"
      "  soda groups --preset paper-fig6 --check -o fig6.html\n"
      "  soda groups --bodies 500,2000 --by overlap,contact --seeds 1..100\n"
      "  soda groups scenarios/library/five-worlds-chain.json --by all");
}

void define_scaling(CLI::App& command, ScalingRequest& request) {
  Overrides& overrides = request.setting.overrides;
  command.add_option("FILE", request.files, "scenarios");
  command.add_option("--library", request.library, "all scenarios of this folder");
  CLI::Option* weak =
      command.add_flag("--weak", request.setting.weak,
                       "a copy of the scene for each world, side by side: the scene grows");
  command
      .add_flag_callback(
          "--strong", [&request] { request.setting.weak = false; },
          "one scene for all worlds (default)")
      ->excludes(weak);
  command.add_option("--worlds", request.worlds,
                     "numbers of worlds, as 1,10,100 (default: the scenario's, or 8)");
  command.add_option("--network", request.network,
                     "shared, infiniband, ten-gbe (default) or internet; --latency-us and "
                     "--bandwidth-mb-s come first");
  command.add_option("--against", request.against,
                     "lockstep, invalidate, ungated, with commas between them; or none (default)");
  command.add_option("--steps", overrides.steps, "(default: the scenario's, at most 20)");
  command.add_option("--buffer", overrides.buffer, "entries of each world's transform buffer");
  command.add_option("--seed", overrides.seed, "replaces every seed of the scenario");
  add_cluster_options(command, overrides.cluster, "modelled from its counters");
  add_report_options(command, {request.json, request.csv, request.page, request.force});
  add_strict_option(command, overrides.strict);
  command.footer(
      "examples:\n"
      "  soda scaling --library scenarios/library\n"
      "  soda scaling scenarios/library/sparse-10000.json --worlds 1,10,100,1000 -o scaling.html\n"
      "  soda scaling scenarios/library/pyramid.json --weak --worlds 1,4,16 --network infiniband");
}

void define_compare(CLI::App& command, CompareRequest& request) {
  command.add_option("FILE", request.file, "scenario")->required();
  command
      .add_option("--over", request.over,
                  "rollback, gating, ghosts, balancing, islands, with commas (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember({"rollback", "gating", "ghosts", "balancing", "islands"}));
  add_run_options(command, request.overrides);
  add_gating_option(command, request.overrides);
  add_cluster_options(command, request.overrides.cluster, "modelled from its counters");
  CLI::Option* json = command.add_flag("--json", request.json, "print one JSON object");
  command.add_flag("--csv", request.csv, "print a line for each setting")->excludes(json);
  add_strict_option(command, request.overrides.strict);
  command.footer(
      "examples:\n"
      "  soda compare scenarios/library/border-stack.json --over rollback --gating off\n"
      "  soda compare scenarios/library/fast-crosser.json --over ghosts --latency-us 1.4");
}

void define_calibrate(CLI::App& command, CalibrateRequest& request) {
  command.add_option("FILE", request.files, "scenarios");
  command.add_option("--library", request.library, "all scenarios of this folder");
  command
      .add_option("--predict", request.threads,
                  "numbers of threads, of each rank, as 1,2: what the virtual cluster says beside "
                  "what runs take")
      ->delimiter(',')
      ->check(CLI::Range(1u, 1024u));
  command.add_option("--costs", request.costs_file,
                     "costs that --output has written, instead of measuring them");
  command.add_option("-o,--output", request.output_file, "where to write the costs");
  command.add_option("--steps", request.steps, "of each scenario (default: its own)");
  command.add_option("--repeat", request.repeat, "runs of each scenario (default 3)")
      ->check(CLI::Range(1, 1000));
  command.add_flag("--check", request.check, "exit 1 if a prediction is off by more than 15 %");
  command.add_flag("--json", request.json, "print one JSON object");
  command.add_flag("--force", request.force, "replace an existing file of --output");
  command.footer(
      "examples:\n"
      "  soda calibrate --library scenarios/library --steps 60 -o costs.json\n"
      "  soda calibrate --costs costs.json scenarios/library/pyramid.json --predict 1,2 --check\n"
      "  mpirun -n 2 soda calibrate --costs costs.json scenarios/library/crowd.json --predict 1");
}

}  // namespace soda::analysis
