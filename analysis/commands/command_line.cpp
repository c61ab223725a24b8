#include "analysis/commands/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <string_view>

#include "analysis/commands/command_guide.hpp"
#include "analysis/commands/command_options.hpp"
#include "analysis/commands/examples_command.hpp"
#include "analysis/commands/measure_options.hpp"
#include "analysis/commands/trace_options.hpp"
#include "analysis/process/installed.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/nearest_name.hpp"
#include "analysis/text/shell_words.hpp"
#include "analysis/text/version.hpp"
#include "scenarios/read_scenario.hpp"
#include "scenarios/reference.hpp"

namespace soda::analysis {
namespace {

bool mentions(int argc, const char* const* argv, std::string_view word) {
  return std::any_of(argv, argv + argc, [word](const char* argument) {
    return std::string_view(argument).starts_with(word);
  });
}

struct Requests {
  RunRequest run;
  PlanRequest plan;
  ReplayRequest replay;
  DiffRequest diff;
  LogRequest log;
  WhyRequest why;
  WhatIfRequest what_if;
  BranchRequest branch;
  TraceRequest trace;
  ContactsRequest contacts;
  ViewRequest view;
  AccuracyRequest accuracy;
  AnticipationRequest anticipation;
  GroupsRequest groups;
  VerifyRequest verify;
  CompareRequest compare;
  ScalingRequest scaling;
  CalibrateRequest calibrate;
  PholdRequest phold;
  SwarmRequest swarm;
  FuzzRequest fuzz;
  bool schema_as_markdown = false;
  std::string shell;              // that completes
  std::string tried;              // the command whose examples are wanted; empty: of all
  const CLI::App* all = nullptr;  // the whole command line, for guides to it
};

struct Command {
  const char* group;
  const char* name;
  const char* purpose;
  bool over_ranks;
  void (*define)(CLI::App& command, Requests& requests, const Wanted& wanted);
  int (*carry_out)(const Requests& requests, std::ostream& out, std::ostream& err);
};

void define_schema(CLI::App& schema, Requests& requests, const Wanted&) {
  schema.add_flag("--markdown", requests.schema_as_markdown,
                  "a page for readers instead: every key with type, unit, range and default");
  schema.footer(
      "examples:\n  soda schema > soda-scenario.schema.json\n"
      "  soda schema --markdown > docs/scenario-format.md");
}

int print_schema(const Requests& requests, std::ostream& out, std::ostream&) {
  out << (requests.schema_as_markdown ? scenarios::scenario_reference_markdown()
                                      : scenarios::scenario_schema());
  return kExitOk;
}

void define_completion(CLI::App& completion, Requests& requests, const Wanted&) {
  completion.add_option("SHELL", requests.shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completion.footer(
      "examples:\n  source <(soda completion bash)\n"
      "  soda completion fish > ~/.config/fish/completions/soda.fish");
}

int print_completion(const Requests& requests, std::ostream& out, std::ostream&) {
  ArgumentWords arguments;
  const std::string cases = installed(kOwnCases);
  if (std::filesystem::is_directory(cases)) arguments["accuracy"] = case_names(cases);
  out << completion_script(*requests.all, requests.shell, arguments);
  return kExitOk;
}

void define_examples(CLI::App& examples, Requests& requests, const Wanted&) {
  examples.add_option("COMMAND", requests.tried, "only what to try of this one");
  examples.footer("examples:\n  soda examples\n  soda examples anticipation");
}

int print_examples(const Requests& requests, std::ostream& out, std::ostream&) {
  const std::string examples = examples_of(*requests.all, requests.tried);
  if (examples.empty()) throw UsageError("no command " + requests.tried + "; see soda --help");
  if (requests.tried.empty()) out << scenes_text("scenarios/library") << "\n";
  out << examples;
  return kExitOk;
}

void define_manual(CLI::App& manual, Requests&, const Wanted&) {
  manual.footer("examples:\n  soda manual | man -l -\n  soda manual > soda.1");
}

int print_manual(const Requests& requests, std::ostream& out, std::ostream&) {
  out << manual_page(*requests.all, kVersion);
  return kExitOk;
}

constexpr const char* kRuns = "Run scenes";
constexpr const char* kLogs = "Look into event logs";
constexpr const char* kMeasures = "Measure";
constexpr const char* kChecks = "Check";
constexpr const char* kGuides = "Guides";

using R = Requests;
using Stream = std::ostream;
constexpr Command kCommands[] = {
    {kRuns, "run", "run a scenario; report error against run time", true,
     [](CLI::App& app, R& r, const Wanted& wanted) { define_run(app, r.run, wanted); },
     [](const R& r, Stream& out, Stream& err) { return run_command(r.run, out, err); }},
    {kRuns, "plan", "show what a run will use, and why", false,
     [](CLI::App& app, R& r, const Wanted&) { define_plan(app, r.plan); },
     [](const R& r, Stream& out, Stream& err) { return plan_command(r.plan, out, err); }},
    {kLogs, "replay", "re-run an event log and compare every step, or show a state", false,
     [](CLI::App& app, R& r, const Wanted&) { define_replay(app, r.replay); },
     [](const R& r, Stream& out, Stream& err) { return replay_command(r.replay, out, err); }},
    {kLogs, "diff", "compare two event logs: options, inputs, and the first step that differs",
     false, [](CLI::App& app, R& r, const Wanted&) { define_diff(app, r.diff); },
     [](const R& r, Stream& out, Stream& err) { return diff_command(r.diff, out, err); }},
    {kLogs, "log", "what an event log holds, as a summary, JSON or CSV", false,
     [](CLI::App& app, R& r, const Wanted&) { define_log(app, r.log); },
     [](const R& r, Stream& out, Stream& err) { return log_command(r.log, out, err); }},
    {kLogs, "why", "what led to the rollbacks of a traced run, and what they cost", false,
     [](CLI::App& app, R& r, const Wanted&) { define_why(app, r.why); },
     [](const R& r, Stream& out, Stream& err) { return why_command(r.why, out, err); }},
    {kLogs, "what-if", "a logged run on the virtual cluster with one thing changed", false,
     [](CLI::App& app, R& r, const Wanted&) { define_what_if(app, r.what_if); },
     [](const R& r, Stream& out, Stream& err) { return what_if_command(r.what_if, out, err); }},
    {kLogs, "branch", "another future from a step of an event log, and how it differs", false,
     [](CLI::App& app, R& r, const Wanted&) { define_branch(app, r.branch); },
     [](const R& r, Stream& out, Stream& err) { return branch_command(r.branch, out, err); }},
    {kLogs, "trace", "the execution of a traced run as a file for ui.perfetto.dev", false,
     [](CLI::App& app, R& r, const Wanted&) { define_trace(app, r.trace); },
     [](const R& r, Stream& out, Stream& err) { return trace_command(r.trace, out, err); }},
    {kLogs, "contacts", "the forces that contacts bear, of steps of an event log", false,
     [](CLI::App& app, R& r, const Wanted&) { define_contacts(app, r.contacts); },
     [](const R& r, Stream& out, Stream& err) { return contacts_command(r.contacts, out, err); }},
    {kLogs, "view", "an event log as a page to look at in a browser", false,
     [](CLI::App& app, R& r, const Wanted&) { define_view(app, r.view); },
     [](const R& r, Stream& out, Stream& err) { return view_command(r.view, out, err); }},
    {kMeasures, "accuracy",
     "error against run time: cases with a known answer, at several settings", false,
     [](CLI::App& app, R& r, const Wanted&) { define_accuracy(app, r.accuracy); },
     [](const R& r, Stream& out, Stream& err) { return accuracy_command(r.accuracy, out, err); }},
    {kMeasures, "anticipation", "how long transform buffers hide an overload (the paper's Fig. 8)",
     true, [](CLI::App& app, R& r, const Wanted&) { define_anticipation(app, r.anticipation); },
     [](const R& r, Stream& out, Stream& err) {
       return anticipation_command(r.anticipation, out, err);
     }},
    {kMeasures, "groups",
     "synchronisation groups, of the paper's scene (its Figs 6 and 7) or of a run", false,
     [](CLI::App& app, R& r, const Wanted&) { define_groups(app, r.groups); },
     [](const R& r, Stream& out, Stream& err) { return groups_command(r.groups, out, err); }},
    {kChecks, "verify", "check one trajectory: every executor against the plain loop, step by step",
     true, [](CLI::App& app, R& r, const Wanted&) { define_verify(app, r.verify); },
     [](const R& r, Stream& out, Stream& err) { return verify_command(r.verify, out, err); }},
    {kMeasures, "compare",
     "what rollback modes, gating, ghosts, balancing and split islands cost on a scene", false,
     [](CLI::App& app, R& r, const Wanted&) { define_compare(app, r.compare); },
     [](const R& r, Stream& out, Stream& err) { return compare_command(r.compare, out, err); }},
    {kMeasures, "scaling",
     "what division gains on the virtual cluster, and where processors' time goes", false,
     [](CLI::App& app, R& r, const Wanted&) { define_scaling(app, r.scaling); },
     [](const R& r, Stream& out, Stream& err) { return scaling_command(r.scaling, out, err); }},
    {kMeasures, "calibrate",
     "what work costs on this machine, and predictions beside what runs take", true,
     [](CLI::App& app, R& r, const Wanted&) { define_calibrate(app, r.calibrate); },
     [](const R& r, Stream& out, Stream& err) { return calibrate_command(r.calibrate, out, err); }},
    {kMeasures, "phold", "benchmark of the kernel: events and no physics", true,
     [](CLI::App& app, R& r, const Wanted&) { define_phold(app, r.phold); },
     [](const R& r, Stream& out, Stream&) { return phold_command(r.phold, out); }},
    {kChecks, "swarm", "random worlds, clusters and adversaries; every commit against the oracle",
     false, [](CLI::App& app, R& r, const Wanted&) { define_swarm(app, r.swarm); },
     [](const R& r, Stream& out, Stream& err) { return swarm_command(r.swarm, out, err); }},
    {kChecks, "fuzz", "random scenes; no fault, escape or gain of energy; a failing one is shrunk",
     false, [](CLI::App& app, R& r, const Wanted&) { define_fuzz(app, r.fuzz); },
     [](const R& r, Stream& out, Stream& err) { return fuzz_command(r.fuzz, out, err); }},
    {kGuides, "examples", "the scenes that come with soda, and commands to try", false,
     define_examples, print_examples},
    {kGuides, "schema", "print the JSON Schema of scenario files", false, define_schema,
     print_schema},
    {kGuides, "completion", "a script that completes commands and options in a shell", false,
     define_completion, print_completion},
    {kGuides, "manual", "the manual page, for man", false, define_manual, print_manual},
};

// None if there is none of this name.
const Command* command_named(const std::string& name) {
  const auto found = std::ranges::find(kCommands, name, &Command::name);
  return found == std::end(kCommands) ? nullptr : &*found;
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

// Whatever the program was started as.
std::string whole_command(int argc, const char* const* argv, const kernel::Transport* job) {
  std::vector<std::string> words;
  if (job != nullptr) words = {"mpirun", "-n", std::to_string(job->size())};
  words.push_back("soda");
  words.insert(words.end(), argv + 1, argv + argc);
  return as_typed(words);
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
  Requests requests;
  const bool guides = mentions(argc, argv, "completion") || mentions(argc, argv, "manual") ||
                      mentions(argc, argv, "examples");
  const bool all = guides || mentions(argc, argv, "--help");
  requests.all = &app;
  const Wanted wanted{.in_real_time = all || mentions(argc, argv, "--realtime"),
                      .balances = all || mentions(argc, argv, "--balancing"),
                      .extrapolates = all || mentions(argc, argv, "--ghost"),
                      .strict = all || mentions(argc, argv, "--strict")};
  // What a command takes to define is a part of what short runs cost: if the first argument is
  // one, it is the only one.
  const Command* const named = guides ? nullptr : command_named(argc > 1 ? argv[1] : "");
  std::vector<std::pair<const CLI::App*, const Command*>> apps;
  for (const Command& command : kCommands) {
    if (named != nullptr && named != &command) continue;
    CLI::App* const added = app.add_subcommand(command.name, command.purpose);
    added->group(command.group);
    if (guides || mentions(argc, argv, command.name)) command.define(*added, requests, wanted);
    apps.push_back({added, &command});
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help, --version
    return app.exit(request, out, err);
  } catch (const CLI::ParseError& error) {
    throw UsageError(usage_message(app, error));
  }
  const auto parsed = std::ranges::find_if(apps, [](const auto& a) { return a.first->parsed(); });
  const Command& command = *parsed->second;
  if (transport != nullptr && !command.over_ranks)
    throw UsageError(
        "started by mpirun; only run, verify, anticipation, calibrate and phold run over ranks");
  for (kernel::Transport** place :
       {&requests.run.overrides.transport, &requests.verify.transport, &requests.phold.transport,
        &requests.anticipation.overrides.transport, &requests.calibrate.job})
    *place = transport;
  for (std::string* place : {&requests.accuracy.command, &requests.anticipation.command,
                             &requests.groups.command, &requests.scaling.command})
    *place = whole_command(argc, argv, transport);
  return command.carry_out(requests, out, err);
}

}  // namespace soda::analysis
