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

}  // namespace soda::analysis
