#include "analysis/whole/whole_run.hpp"

#include <algorithm>
#include <filesystem>

#include "analysis/text/exit_codes.hpp"
#include "analysis/whole/scene_draw.hpp"

namespace soda::analysis {
namespace {

constexpr const char* kExecutorNames[] = {"default", "sequential", "threads", "mpi", "virtual"};
// Of 20.
constexpr unsigned kWeights[] = {4, 1, 7, 4, 4};

RunExecutor draw_executor(Chance& chance, const std::vector<RunExecutor>& executors) {
  unsigned sum = 0;
  for (const RunExecutor executor : executors) sum += kWeights[static_cast<std::size_t>(executor)];
  std::uint32_t place = chance.below(sum);
  for (const RunExecutor executor : executors) {
    const unsigned weight = kWeights[static_cast<std::size_t>(executor)];
    if (place < weight) return executor;
    place -= weight;
  }
  return executors.back();
}

void add_cluster(Chance& chance, std::vector<Option>& options) {
  const auto sometimes = [&](const char* name, double least, double most) {
    if (chance.one_in(2)) options.push_back({name, json_of(chance.powers(least, most))});
  };
  sometimes("--latency-us", 0.1, 1000.0);
  sometimes("--jitter-us", 0.1, 300.0);
  sometimes("--bandwidth-mb-s", 1.0, 1000.0);
  sometimes("--gvt-interval-us", 1.0, 1000.0);
  if (chance.one_in(3)) options.push_back({"--processors", json_of(1 + chance.below(12))});
  if (chance.one_in(4)) options.push_back({"--cost-us", json_of(chance.powers(0.1, 100.0))});
  if (chance.one_in(2)) options.push_back({"--execution-seed", json_of(chance.below(1000))});
  if (chance.one_in(8)) options.push_back({"--check-purity"});
}

void add_worlds(Chance& chance, std::uint32_t cells, std::vector<Option>& options) {
  constexpr std::uint32_t kWorlds[] = {1, 2, 3, 4, 6, 8, 12, 24, 48, 64};
  constexpr int kBuffers[] = {1, 2, 3, 4, 8, 16, 48, 64};
  if (chance.one_in(4))
    options.push_back({"--worlds", json_of(std::min(cells, chance.one_of(kWorlds)))});
  if (chance.one_in(4)) options.push_back({"--buffer", json_of(chance.one_of(kBuffers))});
}

void add_modes(Chance& chance, std::vector<Option>& options) {
  if (chance.one_in(10)) options.push_back({"--policy", "lockstep"});
  if (chance.one_in(5)) options.push_back({"--rollback", "invalidate"});
  if (chance.one_in(3)) options.push_back({"--gating", "off"});
  if (chance.one_in(5)) options.push_back({"--split-islands", "off"});
  if (chance.one_in(3))
    options.push_back({"--ghosts", chance.one_in(2) ? "dead-reckoning" : "predicted"});
  if (chance.one_in(4)) {
    options.push_back({"--balancing", chance.one_in(2) ? "paper" : "random", "--balancing-interval",
                       json_of(1 + chance.below(12))});
  }
  if (chance.one_in(5)) options.push_back({"--scheduling-seed", json_of(1 + chance.below(1000))});
}

// Without gating a slow network is busy with what is taken back: 99.8 % of the events, and a
// thousand times what the plain loop takes, as such a cluster would. That would be taken for a
// hang.
void leave_out_slow_networks_without_gating(std::vector<Option>& options) {
  const bool gates = std::ranges::find(options, Option{"--gating", "off"}) == options.end();
  if (!gates)
    std::erase_if(options, [](const Option& option) { return option[0] == "--bandwidth-mb-s"; });
}

void append(const std::vector<Option>& options, std::vector<std::string>& command) {
  for (const Option& option : options) command.insert(command.end(), option.begin(), option.end());
}

}  // namespace

const char* name_of(RunExecutor executor) {
  return kExecutorNames[static_cast<std::size_t>(executor)];
}

std::vector<RunExecutor> parse_executors(const std::vector<std::string>& names) {
  std::vector<RunExecutor> executors;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(kExecutorNames, name);
    if (found == std::end(kExecutorNames))
      throw UsageError("--executors: found " + name +
                       "; allowed: default, sequential, threads, mpi, virtual");
    executors.push_back(static_cast<RunExecutor>(found - std::begin(kExecutorNames)));
  }
  return executors;
}

WholeRun draw_run(std::uint64_t seed, const WholeScene& scene,
                  const std::vector<RunExecutor>& executors) {
  Chance chance(seed, 13);
  WholeRun run;
  run.executor = draw_executor(chance, executors);
  constexpr unsigned kRanks[] = {1, 2, 2, 4};
  constexpr int kThreads[] = {1, 2, 2, 4};
  run.ranks = chance.one_of(kRanks);
  run.logged = chance.one_in(3);
  if (chance.one_in(2)) run.replay_options = {{"--threads", json_of(chance.one_of(kThreads))}};
  if (run.executor == RunExecutor::kDefault) return run;
  run.options.push_back({"--executor", name_of(run.executor)});
  if (run.executor == RunExecutor::kThreads)
    run.options.push_back({"--threads", json_of(chance.one_of(kThreads))});
  if (run.executor == RunExecutor::kMpi && chance.one_in(3))
    run.options.push_back({"--threads", "2"});
  if (run.executor == RunExecutor::kVirtual) add_cluster(chance, run.options);
  add_worlds(chance, scene.cells, run.options);
  if (run.executor != RunExecutor::kSequential) add_modes(chance, run.options);
  leave_out_slow_networks_without_gating(run.options);
  return run;
}

std::vector<std::string> run_command_of(const WholeRun& run, const std::string& program,
                                        const std::string& file, const std::string& log) {
  std::vector<std::string> command;
  // Jobs that begin and end at once quarrel about Open MPI's folder if they share it.
  if (run.executor == RunExecutor::kMpi)
    command = {"mpirun",
               "-n",
               std::to_string(run.ranks),
               "--oversubscribe",
               "--mca",
               "orte_tmpdir_base",
               std::filesystem::absolute(file).parent_path().string()};
  command.insert(command.end(), {program, "run", file});
  append(run.options, command);
  if (run.logged) command.insert(command.end(), {"--log", log});
  command.insert(command.end(), {"--step-digests", "--json", "--quiet"});
  return command;
}

std::vector<std::string> replay_command_of(const WholeRun& run, const std::string& program,
                                           const std::string& log) {
  std::vector<std::string> command = {program, "replay", log, "--quiet"};
  append(run.replay_options, command);
  return command;
}

}  // namespace soda::analysis
