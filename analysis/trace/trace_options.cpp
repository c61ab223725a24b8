#include "analysis/trace/trace_options.hpp"

#include <CLI/CLI.hpp>

#include "analysis/shared_options.hpp"

namespace soda::analysis {

void define_log(CLI::App& command, LogRequest& request) {
  command.add_option("LOG", request.file, "log written by soda run --log")->required();
  command
      .add_option("--lines", request.lines,
                  "of --json and --csv: steps (default), states, inputs or events")
      ->check(CLI::IsMember({"steps", "states", "inputs", "events"}));
  CLI::Option* json = command.add_flag("--json", request.json, "an array, an object for each line");
  command.add_flag("--csv", request.csv, "a table with a line of names")->excludes(json);
  command.footer(
      "examples:\n"
      "  soda log run.sodalog\n"
      "  soda log run.sodalog --csv --lines states > states.csv\n"
      "  soda log run.sodalog --json --lines events");
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
