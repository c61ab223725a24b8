#include "analysis/commands/whole_command.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <ostream>
#include <span>

#include "analysis/commands/search_json.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/shell_words.hpp"
#include "analysis/text/stopwatch.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/whole/program_run.hpp"
#include "analysis/whole/whole_scene.hpp"
#include "analysis/whole/whole_search.hpp"
#include "analysis/whole/whole_workers.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// What does not fit into this much is out of bounds for scenes of this size.
constexpr std::uint64_t kAddressBytes = std::uint64_t{8} << 30;

bool starts(std::vector<std::string> command, const std::string& program, std::uint64_t bytes) {
  command.insert(command.end(), {program, "--version"});
  return run_program(command, {60.0, 120.0, bytes}).exit_code == kExitOk;
}

WholePlace find_place(const WholeRequest& request) {
  WholePlace place;
  place.program = request.program.empty() ? own_program() : request.program;
  place.patience_s = request.patience_s;
  if (!starts({}, place.program, 0))
    throw UsageError("--program: " + place.program + " does not run");
  // The address sanitizer's shadow is larger than any limit.
  if (starts({}, place.program, kAddressBytes)) place.address_bytes = kAddressBytes;
  return place;
}

std::vector<RunExecutor> find_executors(const WholeRequest& request, const WholePlace& place,
                                        WholeResult& result) {
  std::vector<RunExecutor> executors = parse_executors(
      request.executors.empty()
          ? std::vector<std::string>{"default", "sequential", "threads", "mpi", "virtual"}
          : request.executors);
  const auto mpi = std::ranges::find(executors, RunExecutor::kMpi);
  if (mpi == executors.end() || starts({"mpirun", "-n", "1"}, place.program, place.address_bytes))
    return executors;
  if (!request.executors.empty()) throw UsageError("--executors: mpirun does not run the program");
  result.left_out = "mpi: mpirun does not run the program";
  executors.erase(mpi);
  return executors;
}

WholeFailure shrunk_failure(const WholeTrial& trial, const WholeOutcome& outcome,
                            const WholeRequest& request, const WholePlace& place) {
  // Waiting for what hangs takes long: then fewer trials must do.
  constexpr double kMost_s = 240.0;
  const Stopwatch stopwatch;
  const ShrinkLimits limits{request.most_shrinking,
                            [&] { return stopwatch.elapsed().wall_s > kMost_s; }};
  const ShrunkWhole smallest = shrink(
      trial, outcome, limits, [&](const WholeTrial& smaller) { return try_whole(smaller, place); });
  WholeFailure failure;
  failure.seed = trial.seed;
  failure.kind = name_of(outcome.kind);
  failure.what = outcome.what;
  failure.shrunk_what = smallest.outcome.what;
  failure.tried = smallest.tried;
  failure.text = scene_text(smallest.trial.scene);
  const std::string name = "whole-" + std::to_string(trial.seed);
  std::string file = name + ".json";
  if (!request.folder.empty())
    file = failure.file = write_scene(smallest.trial.scene, request.folder, name);
  failure.command =
      as_typed(run_command_of(smallest.trial.run, place.program, file, "run.sodalog"));
  if (smallest.trial.run.logged)
    failure.command +=
        " && " + as_typed(replay_command_of(smallest.trial.run, place.program, "run.sodalog"));
  if (request.folder.empty()) return failure;
  std::ofstream told(request.folder + "/" + name + ".txt", std::ios::trunc);
  told << failure.kind << ": " << failure.what << "\nshrunk: " << failure.shrunk_what << "\n"
       << failure.command << "\n";
  return failure;
}

SeedReport try_seed(std::uint64_t seed, const std::string& folder, const WholeRequest& request,
                    WholePlace place, const std::vector<RunExecutor>& executors) {
  place.folder = folder;
  WholeTrial trial{seed, draw_whole_scene(seed), {}};
  trial.run = draw_run(seed, trial.scene, executors);
  const WholeOutcome outcome = try_whole(trial, place);
  SeedReport report{outcome.failed(), {}};
  report.bytes.resize(sizeof outcome.sums);
  std::memcpy(report.bytes.data(), &outcome.sums, sizeof outcome.sums);
  put(report.bytes, outcome.plain_fault);
  put(report.bytes, std::uint8_t{outcome.failed()});
  if (!outcome.failed()) return report;
  const WholeFailure failure = shrunk_failure(trial, outcome, request, place);
  for (const std::string* text : {&failure.kind, &failure.what, &failure.shrunk_what,
                                  &failure.command, &failure.file, &failure.text})
    put(report.bytes, *text);
  put(report.bytes, failure.tried);
  return report;
}

void take_report(std::uint64_t seed, const ByteBuffer& bytes, WholeResult& result) {
  WholeSums sums;
  std::memcpy(&sums, bytes.data(), sizeof sums);
  ByteReader reader(std::span<const unsigned char>(bytes).subspan(sizeof sums));
  ++result.trials;
  add(sums, result.sums);
  const std::string fault = reader.take_string();
  if (!fault.empty()) result.suspicious.push_back({seed, fault});
  if (reader.take<std::uint8_t>() == 0) return;
  WholeFailure failure;
  failure.seed = seed;
  for (std::string* text : {&failure.kind, &failure.what, &failure.shrunk_what, &failure.command,
                            &failure.file, &failure.text})
    *text = reader.take_string();
  failure.tried = reader.take<unsigned>();
  result.failures.push_back(std::move(failure));
}

void show_progress(const WholeResult& result, std::uint64_t seeds, double elapsed_s) {
  std::cerr << "\r\x1b[K" << result.trials << " of " << seeds << " scenes, "
            << result.failures.size() << " failed, " << format_number(elapsed_s, 3) << " s"
            << std::flush;
}

}  // namespace

WholeResult fuzz_whole(const WholeRequest& request) {
  const SeedRange seeds = parse_seeds(request.seeds);
  const Stopwatch stopwatch;
  WholeResult result;
  const WholePlace place = find_place(request);
  const std::vector<RunExecutor> executors = find_executors(request, place, result);
  if (!request.folder.empty()) {
    std::error_code error;
    std::filesystem::create_directories(request.folder, error);
    if (error) throw scenarios::FileError(request.folder + ": " + error.message());
  }
  const bool shows = isatty(STDERR_FILENO) == 1;
  result.end = share_seeds(
      seeds, {request.jobs, request.budget_s, request.most_failures},
      [&](std::uint64_t seed, const std::string& folder) {
        return try_seed(seed, folder, request, place, executors);
      },
      [&](std::uint64_t seed, const ByteBuffer& bytes) {
        take_report(seed, bytes, result);
        if (shows) show_progress(result, seeds.last - seeds.first + 1, stopwatch.elapsed().wall_s);
      });
  if (shows) std::cerr << "\r\x1b[K" << std::flush;
  std::ranges::sort(result.failures, {}, &WholeFailure::seed);
  std::ranges::sort(result.suspicious, {}, &SuspiciousScene::seed);
  result.wall_s = stopwatch.elapsed().wall_s;
  return result;
}

std::string whole_text(const WholeResult& result) {
  const WholeSums& sums = result.sums;
  std::string text = std::to_string(result.trials) + " scenes in " + format_number(result.wall_s) +
                     " s" + text_of(result.end) + ":";
  for (std::size_t i = 0; i < kRunExecutors; ++i)
    text += std::string(i > 0 ? "," : "") + " " + std::to_string(sums.scenes[i]) + " " +
            name_of(static_cast<RunExecutor>(i));
  text += "; " + std::to_string(sums.bodies) + " bodies, " + std::to_string(sums.steps) +
          " steps; " + std::to_string(sums.rolled_back) + " of " + std::to_string(sums.events) +
          " events rolled back in " + std::to_string(sums.rollbacks) + " rollbacks of " +
          std::to_string(sums.runs_with_rollbacks) + " runs, " + std::to_string(sums.migrations) +
          " migrations, " + std::to_string(sums.replays) + " replays; the plain loop took " +
          format_number(sums.plain_s) + " s, the program " + format_number(sums.program_s) + " s\n";
  if (!result.left_out.empty()) text += "left out: " + result.left_out + "\n";
  for (const SuspiciousScene& scene : result.suspicious)
    text += "numerical failure in the plain loop too: seed " + std::to_string(scene.seed) + ", " +
            scene.what + "\n";
  for (const WholeFailure& failure : result.failures) {
    text += "FAILED: seed " + std::to_string(failure.seed) + ", " + failure.kind + "\n  " +
            failure.what + "\nshrunk in " + std::to_string(failure.tried) + " trials to\n  " +
            failure.shrunk_what + "\nreproduce with\n  " + failure.command + "\n";
    if (failure.file.empty()) text += failure.text;
  }
  return text +
         (result.failures.empty() && result.trials > 0 ? "every run is the plain loop's\n" : "");
}

int whole_command(const WholeRequest& request, std::ostream& out) {
  const WholeResult result = fuzz_whole(request);
  out << (request.json ? whole_json(result) : whole_text(result));
  return exit_code_of(result.end, !result.failures.empty());
}

}  // namespace soda::analysis
