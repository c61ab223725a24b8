#include "analysis/whole/whole_trial.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "analysis/process/isolated_process.hpp"
#include "analysis/runs/plain_loop.hpp"
#include "analysis/text/byte_codec.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/stopwatch.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/whole/program_run.hpp"
#include "analysis/whole/run_output.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using Kind = WholeFailureKind;

// What the plain loop says of a scene.
struct Oracle {
  std::vector<std::uint64_t> digests;  // [k] after step k + 1
  std::optional<PlainFault> fault;
  std::int64_t steps = 0;  // that a run takes: beyond the digests by one if there is a fault
  std::uint64_t bodies = 0;
  double cpu_s = 0.0;
  Kind kind = Kind::kNone;
  std::string what;
};

constexpr const char* kRefusedSign = "refused";

void write_oracle(const scenarios::Scenario& scenario, const WholePlace& place,
                  ChildResults& results) {
  const double start_s = thread_cpu_s();
  const PlainLoop loop(scenario, scenario.run.inputs.script, {true, place.plain_work});
  ByteBuffer bytes;
  put(bytes, static_cast<std::uint64_t>(scenario.initial.size()));
  put(bytes, thread_cpu_s() - start_s);
  put(bytes, static_cast<std::uint64_t>(loop.steps()));
  for (std::int64_t k = 1; k <= loop.steps(); ++k) put(bytes, loop.digest_after(k));
  put(bytes, std::uint8_t{loop.fault().has_value()});
  if (loop.fault()) {
    put(bytes, loop.fault()->step);
    put(bytes, loop.fault()->body_label);
    put(bytes, loop.fault()->what);
  }
  for (const unsigned char byte : bytes) results.write(byte);
}

void read_oracle(const std::string& text, Oracle& oracle) {
  const ByteBuffer bytes(text.begin(), text.end());
  ByteReader reader(bytes);
  oracle.bodies = reader.take<std::uint64_t>();
  oracle.cpu_s = reader.take_double();
  oracle.digests.resize(reader.take_count(sizeof(std::uint64_t)));
  for (std::uint64_t& digest : oracle.digests) digest = reader.take<std::uint64_t>();
  oracle.steps = static_cast<std::int64_t>(oracle.digests.size());
  if (reader.take<std::uint8_t>() == 0) return;
  oracle.fault.emplace();
  oracle.fault->step = reader.take<std::int64_t>();
  oracle.fault->body_label = reader.take<std::uint32_t>();
  oracle.fault->what = reader.take_string();
  ++oracle.steps;
}

Oracle ask_oracle(const std::string& file, const WholePlace& place) {
  const ChildOutcome child = run_in_child([&](ChildResults& results) {
    try {
      write_oracle(scenarios::read_scenario_file(file), place, results);
    } catch (const scenarios::InputError& error) {
      throw CheckFailed(std::string(kRefusedSign) + ": " + error.what());
    }
  });
  Oracle oracle;
  if (child.failed) {
    oracle.kind = child.what.starts_with(kRefusedSign) ? Kind::kRefused : Kind::kPlainLoop;
    oracle.what = child.what;
  } else {
    read_oracle(child.bytes, oracle);
  }
  return oracle;
}

struct Verdict {
  Kind kind = Kind::kNone;
  std::string what;
};

// The first lines of what a program says, warnings left out.
std::string told(const ProgramOutcome& run) {
  constexpr std::size_t kMost = 400;
  std::istringstream lines(run.err);
  std::string text;
  for (std::string line; text.size() < kMost && std::getline(lines, line);)
    if (line.find(": warning ") == std::string::npos) text += (text.empty() ? ": " : "|") + line;
  return text.substr(0, kMost);
}

// What holds for every run of the program: it ends, by itself, and no sanitizer speaks.
Verdict judge_ending(const ProgramOutcome& run, double plain_s) {
  for (const char* sign : {"Sanitizer: ", "runtime error: "})
    if (const std::size_t place = run.err.find(sign); place != std::string::npos)
      return {Kind::kSanitizer, run.err.substr(place, 600)};
  if (run.timed_out)
    return {Kind::kHang, "was ended after " + format_number(run.wall_s) +
                             " s; the plain loop took " + format_number(plain_s) + " s" +
                             told(run)};
  // mpirun passes the signal of a rank on as a code beyond 128.
  if (run.signal != 0 || run.exit_code > 128)
    return {Kind::kCrash, "ended by signal " +
                              std::to_string(run.signal != 0 ? run.signal : run.exit_code - 128) +
                              told(run)};
  return {};
}

Verdict judge_fault(const ProgramOutcome& run, const PlainFault& expected) {
  const std::string plain = "the plain loop fails in step " + std::to_string(expected.step) +
                            ", body " + std::to_string(expected.body_label) + ": " + expected.what;
  if (run.exit_code != kExitNumerical)
    return {Kind::kExitCode,
            "exit code " + std::to_string(run.exit_code) + told(run) + "; expected 4: " + plain};
  const std::optional<ToldFault> fault = find_fault(run.err);
  if (fault && fault->step == expected.step && fault->body == expected.body_label) return {};
  return {Kind::kFault, "another fault" + told(run) + "; " + plain};
}

Verdict judge_digests(const RunOutput& output, const Oracle& oracle) {
  for (std::size_t k = 0; k < std::max(output.step_digests.size(), oracle.digests.size()); ++k) {
    if (k >= output.step_digests.size() || k >= oracle.digests.size())
      return {Kind::kDivergence, std::to_string(output.step_digests.size()) + " steps, not " +
                                     std::to_string(oracle.digests.size())};
    if (output.step_digests[k] == format_digest(oracle.digests[k])) continue;
    return {Kind::kDivergence, "step " + std::to_string(k + 1) + " has digest " +
                                   output.step_digests[k] + ", in the plain loop " +
                                   format_digest(oracle.digests[k])};
  }
  if (!oracle.digests.empty() && output.digest != output.step_digests.back())
    return {Kind::kDivergence, "the last step's digest is " + output.step_digests.back() +
                                   ", the run's " + output.digest};
  return {};
}

Verdict judge_run(const ProgramOutcome& run, const Oracle& oracle, WholeSums& sums) {
  if (Verdict ending = judge_ending(run, oracle.cpu_s); ending.kind != Kind::kNone) return ending;
  if (oracle.fault) return judge_fault(run, *oracle.fault);
  if (run.exit_code != kExitOk)
    return {Kind::kExitCode, "exit code " + std::to_string(run.exit_code) + told(run)};
  const std::optional<RunOutput> output = parse_run_output(run.out);
  if (!output) return {Kind::kExitCode, "exit code 0, but what it printed is no result"};
  sums.events += output->events;
  sums.rolled_back += output->rolled_back;
  sums.rollbacks += output->rollbacks;
  sums.migrations += output->migrations;
  sums.runs_with_rollbacks += output->rollbacks > 0;
  return judge_digests(*output, oracle);
}

Verdict judge_replay(const ProgramOutcome& run, double plain_s) {
  Verdict ending = judge_ending(run, plain_s);
  if (ending.kind == Kind::kNone && run.exit_code != kExitOk)
    ending = {Kind::kReplay, "exit code " + std::to_string(run.exit_code) + told(run)};
  if (ending.kind != Kind::kNone) ending.what = "replay: " + ending.what;
  return ending;
}

void run_all(const WholeTrial& trial, const WholePlace& place, const std::string& file,
             const Oracle& oracle, WholeOutcome& outcome) {
  const std::string log = place.folder + "/run.sodalog";
  std::filesystem::remove(log);
  // Time Warp over many worlds and few processors does a step many times. Hundreds is livelock.
  const double cpu_s = place.patience_s + 300.0 * oracle.cpu_s;
  const ProgramLimits limits{cpu_s, 8.0 * cpu_s, place.address_bytes};
  const auto run = [&](const std::vector<std::string>& command) {
    ProgramOutcome done = run_program(command, limits);
    outcome.sums.program_s += done.wall_s;
    return done;
  };
  const auto take = [&](Verdict verdict) {
    outcome.kind = verdict.kind;
    outcome.what = std::move(verdict.what);
  };
  take(judge_run(run(run_command_of(trial.run, place.program, file, log)), oracle, outcome.sums));
  if (outcome.failed() || oracle.fault || !trial.run.logged) return;
  ++outcome.sums.replays;
  take(judge_replay(run(replay_command_of(trial.run, place.program, log)), oracle.cpu_s));
}

}  // namespace

const char* name_of(WholeFailureKind kind) {
  constexpr const char* kNames[] = {"none",   "refused scene", "plain loop",  "crash",
                                    "hang",   "exit code",     "other fault", "divergence",
                                    "replay", "sanitizer"};
  return kNames[static_cast<std::size_t>(kind)];
}

void add(const WholeSums& more, WholeSums& sums) {
  for (std::size_t i = 0; i < kRunExecutors; ++i) sums.scenes[i] += more.scenes[i];
  sums.bodies += more.bodies;
  sums.steps += more.steps;
  sums.events += more.events;
  sums.rolled_back += more.rolled_back;
  sums.rollbacks += more.rollbacks;
  sums.migrations += more.migrations;
  sums.replays += more.replays;
  sums.runs_with_rollbacks += more.runs_with_rollbacks;
  sums.plain_faults += more.plain_faults;
  sums.plain_s += more.plain_s;
  sums.program_s += more.program_s;
}

std::string write_scene(const WholeScene& scene, const std::string& folder,
                        const std::string& name) {
  const auto write = [&](const std::string& file, const std::string& text) {
    std::ofstream out(file, std::ios::trunc | std::ios::binary);
    out << text;
    out.close();
    if (!out) throw scenarios::FileError(file + ": cannot be written");
  };
  for (const SceneMesh& mesh : scene.meshes) write(folder + "/" + mesh.name, mesh.text);
  std::string file = folder + "/" + name + ".json";
  write(file, scene_text(scene));
  return file;
}

WholeOutcome try_whole(const WholeTrial& trial, const WholePlace& place) {
  WholeOutcome outcome;
  const std::string name = "whole-" + std::to_string(trial.seed);
  const std::string file = write_scene(trial.scene, place.folder, name);
  const Oracle oracle = ask_oracle(file, place);
  outcome.kind = oracle.kind;
  outcome.what = oracle.what;
  if (outcome.failed()) return outcome;
  WholeScene cut = trial.scene;
  cut.head.drop("duration_s");
  cut.head.set("steps", json_of(oracle.steps));
  write_scene(cut, place.folder, name);
  outcome.steps = oracle.steps;
  outcome.sums.scenes[static_cast<std::size_t>(trial.run.executor)] = 1;
  outcome.sums.bodies = oracle.bodies;
  outcome.sums.steps = oracle.digests.size();
  outcome.sums.plain_s = oracle.cpu_s;
  outcome.sums.plain_faults = oracle.fault.has_value();
  if (oracle.fault)
    outcome.plain_fault = "step " + std::to_string(oracle.fault->step) + ", body " +
                          std::to_string(oracle.fault->body_label) + ": " + oracle.fault->what;
  run_all(trial, place, file, oracle, outcome);
  return outcome;
}

}  // namespace soda::analysis
