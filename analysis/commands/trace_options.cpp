#include "analysis/commands/trace_options.hpp"

#include <CLI/CLI.hpp>

#include "analysis/commands/shared_options.hpp"
#include "analysis/trace/event_pattern.hpp"

namespace soda::analysis {

void define_replay(CLI::App& replay, ReplayRequest& request) {
  replay.add_option("LOG", request.file, "log written by soda run --log")->required();
  add_execution_options(replay, request.overrides);
  add_world_options(replay, request.overrides, true, true);
  replay.add_option("--scheduling-seed", request.overrides.scheduling_seed,
                    "threads executor: shuffle its scheduling (0: do not)");
  replay.add_flag("--as-executed", request.as_executed,
                  "in one thread, event for event as the log's trace has it");
  CLI::Option* until =
      replay.add_option("--until", request.until, "as executed, and stop after this EVENT");
  CLI::Option* before =
      replay
          .add_option("--break", request.break_before,
                      "as executed, and stop before this EVENT, as rollback[:WORLD[:STEP]]")
          ->excludes(until);
  CLI::Option* interactive =
      replay
          .add_flag("--interactive", request.interactive,
                    "walk through the trace by commands of standard input; help lists them")
          ->excludes(until)
          ->excludes(before);
  CLI::Option* step = replay.add_option("--step", request.step, "show the state after this step")
                          ->excludes(until)
                          ->excludes(before)
                          ->excludes(interactive);
  replay.add_option("--body", request.body,
                    "with --step, --until or --break: only this body, all digits");
  replay
      .add_flag("--json", request.json,
                "what soda run --json says, of this run; or where it stopped")
      ->excludes(step)
      ->excludes(interactive);
  replay.add_flag("--quiet", request.quiet, "no progress line");
  add_strict_option(replay, request.overrides.strict);
  replay.footer(std::string("examples:\n"
                            "  soda replay run.sodalog\n"
                            "  soda replay run.sodalog --json\n"
                            "  soda replay run.sodalog --threads 2 --worlds 48\n"
                            "  soda replay run.sodalog --step 100 --body 7\n"
                            "  soda replay run.sodalog --until world:1:84:pairs --body 7\n"
                            "  soda replay run.sodalog --break rollback:1\n"
                            "  soda replay run.sodalog --interactive\n"
                            "an EVENT is one of ") +
                event_forms());
}

void define_view(CLI::App& view, ViewRequest& request) {
  view.add_option("LOG", request.file, "log written by soda run --log")->required();
  view.add_option("-o,--output", request.page_file, "HTML file (default: LOG.html)");
  view.add_flag("--force", request.force, "replace the page if it exists");
  view.add_option("--every", request.every,
                  "steps from frame to frame (default: so that bodies take 14 MB at most)")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 40));
  view.footer(
      "The timeline of all worlds is in the page if the log has a trace; soda run --view makes "
      "one.\n"
      "examples:\n"
      "  soda run scenarios/library/crowd.json --log crowd.sodalog --log-level trace\n"
      "  soda view crowd.sodalog\n"
      "  soda view crowd.sodalog --every 10 -o crowd.html");
}

void define_log(CLI::App& command, LogRequest& request) {
  command.add_option("LOG", request.file, "log written by soda run --log")->required();
  command
      .add_option("--lines", request.lines,
                  "of --json and --csv: steps (default), states, worlds (what each did for each "
                  "step), inputs or events")
      ->check(CLI::IsMember({"steps", "states", "worlds", "inputs", "events"}));
  CLI::Option* json = command.add_flag("--json", request.json, "an array, an object for each line");
  CLI::Option* csv =
      command.add_flag("--csv", request.csv, "a table with a line of names")->excludes(json);
  command.add_option("--body", request.bodies, "of --lines states: only these bodies");
  command
      .add_option("--vtk", request.vtk_folder,
                  "write bodies and contacts of every step for ParaView into this folder")
      ->excludes(json)
      ->excludes(csv);
  command.add_flag("--surfaces", request.surfaces, "with --vtk: bodies as triangles, too");
  command
      .add_option("--every", request.every,
                  "of --vtk and --lines states: steps from one to the next; the last is there, too")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 40));
  command.add_flag("--force", request.force, "with --vtk: replace the folder if it exists");
  command.footer(
      "examples:\n"
      "  soda log run.sodalog\n"
      "  soda log run.sodalog --csv --lines states --body 3 --body 7 > two.csv\n"
      "  soda log run.sodalog --csv --lines worlds > worlds.csv\n"
      "  soda log run.sodalog --json --lines events\n"
      "  soda log run.sodalog --vtk run-vtk --every 10 --surfaces");
}

void define_why(CLI::App& command, WhyRequest& request) {
  command.add_option("LOG", request.file, "log written by soda run --log-level trace")->required();
  command.add_option("--world", request.world, "only rollbacks of this world");
  command.add_option("--step", request.step, "only those that undid something of this step");
  command.add_option("--body", request.body, "only those that this body had to do with");
  command.add_option("--rollback", request.rollback, "only this one, from 1")
      ->check(CLI::PositiveNumber);
  command.add_flag("--all", request.all, "each rollback, and what would have helped");
  command.add_flag("--json", request.json, "print one JSON object");
  command.footer(
      "examples:\n"
      "  soda run scenarios/library/border-stack.json --log run.sodalog --log-level trace\n"
      "  soda why run.sodalog\n"
      "  soda why run.sodalog --world 1 --step 20\n"
      "  soda why run.sodalog --all");
}

void define_what_if(CLI::App& command, WhatIfRequest& request) {
  command.add_option("LOG", request.file, "log written by soda run --log")->required();
  command.add_option("--deliver-in-time", request.deliver_in_time,
                     "a late message, as soda why names it: its receiver waits for it");
  command.add_option("--worlds", request.overrides.worlds, "territories");
  command.add_option("--buffer", request.overrides.buffer,
                     "entries of each world's transform buffer");
  add_world_options(command, request.overrides, true, true);
  command.add_flag("--json", request.json, "print one JSON object");
  command.footer(
      "examples:\n"
      "  soda what-if run.sodalog --gating on\n"
      "  soda what-if run.sodalog --buffer 8 --latency-us 100\n"
      "  soda what-if run.sodalog --deliver-in-time 1:42");
}

void define_branch(CLI::App& command, BranchRequest& request) {
  command.add_option("LOG", request.file, "log written by soda run --log")->required();
  command.add_option("--step", request.step, "the committed step from which it goes on")
      ->required();
  command.add_option("--inputs", request.inputs, "file of new inputs, one JSON object a line")
      ->required();
  command.add_option("--steps", request.steps, "its last step (default: that of the log)");
  command.add_option("--log", request.log_file, "write the branch as an event log");
  command.add_flag("--force", request.force, "replace the log if it exists");
  command.add_flag("--json", request.json, "print one JSON object, with every step");
  command.add_flag("--quiet", request.quiet, "no progress line");
  command.footer(
      "example:\n"
      "  soda run scenarios/library/crowd.json --log run.sodalog\n"
      "  echo '{\"id\": 900, \"type\": \"push\", \"step\": 30, \"body\": 7,"
      " \"impulse_newton_s\": [4, 0, 0]}' > push.jsonl\n"
      "  soda branch run.sodalog --step 30 --inputs push.jsonl --log branch.sodalog\n"
      "  soda view branch.sodalog");
}

void define_trace(CLI::App& command, TraceRequest& request) {
  command.add_option("LOG", request.file, "log written by soda run --log-level trace")->required();
  command.add_option("-o,--output", request.trace_file,
                     "trace file (default: the log's name and .json)");
  command.add_flag("--force", request.force, "replace the file if it exists");
  command.footer(
      "example:\n"
      "  soda run scenarios/library/border-stack.json --log run.sodalog --log-level trace\n"
      "  soda trace run.sodalog -o trace.json");
}

void define_diff(CLI::App& diff, DiffRequest& request) {
  diff.add_option("LOG", request.files[0], "log written by soda run --log")->required();
  diff.add_option("OTHER", request.files[1], "another one")->required();
  diff.add_flag("--json", request.json, "print one JSON object");
  diff.footer(
      "example:\n"
      "  soda run scenarios/library/crowd.json --log a.sodalog\n"
      "  soda run scenarios/library/crowd.json --worlds 4 --log b.sodalog\n"
      "  soda diff a.sodalog b.sodalog");
}

void define_contacts(CLI::App& command, ContactsRequest& request) {
  command.add_option("LOG", request.file, "log written by soda run --log")->required();
  CLI::Option* step =
      command.add_option("--step", request.step, "after this step (default: the last)");
  command.add_option("--every", request.every, "after step 0 and each multiple of this")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 40))
      ->excludes(step);
  command.add_option("--body", request.body, "only contacts of this body");
  CLI::Option* csv = command.add_flag("--csv", request.csv, "a line for each contact point");
  command.add_flag("--json", request.json, "print one JSON object")->excludes(csv);
  command.footer(
      "examples:\n"
      "  soda run scenarios/library/pyramid.json --log pyramid.sodalog\n"
      "  soda contacts pyramid.sodalog --body 0\n"
      "  soda contacts pyramid.sodalog --every 60 --csv > forces.csv");
}

}  // namespace soda::analysis
