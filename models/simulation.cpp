#include "models/simulation.hpp"

#include <algorithm>
#include <deque>
#include <memory>
#include <utility>

#include "kernel/partition.hpp"
#include "models/commit_merge.hpp"
#include "models/solve_share.hpp"
#include "models/work_cost.hpp"
#include "models/world.hpp"

namespace soda::models {
namespace {

using Worlds = std::vector<std::unique_ptr<kernel::LogicalProcess>>;

// How many shares of solves there are: worlds of one process share, and a virtual processor models
// a process.
std::size_t share_count(const RunOptions& options, std::uint32_t worlds) {
  if (options.executor != ExecutorKind::kVirtual) return 1;
  return std::min<std::size_t>(options.cluster.processors, worlds);
}

struct Surroundings {
  const physics::SceneDescription& scene;
  const physics::Geometry& geometry;
  const TerritoryMap& map;
  std::deque<SolveShare>& shares;
  CommitMerge& commits;
};

// Every body starts in the world that owns its centre.
Worlds build_worlds(const Surroundings& around, std::span<const physics::BodyState> initial,
                    std::int64_t buffer) {
  std::vector<BufferEntry> entries(around.map.worlds());
  for (std::uint32_t body = 0; body < initial.size(); ++body) {
    BufferEntry& entry = entries[index_of(around.map.owner_at(initial[body].position_m))];
    entry.ids.push_back(physics::BodyId{body});
    entry.states.push_back(initial[body]);
  }
  const kernel::Partition partition{entries.size(), around.shares.size()};
  Worlds worlds;
  for (std::uint32_t id = 0; id < entries.size(); ++id) {
    entries[id].step = 0;
    SolveShare& share = around.shares[partition.owner_of(kernel::LpId{id})];
    worlds.push_back(std::make_unique<World>(
        WorldSurroundings{around.scene, around.geometry, around.map, share, around.commits},
        WorldId{id}, buffer, std::move(entries[id])));
  }
  return worlds;
}

// Asked once after each event of a world: what its counters say has been done since.
std::function<std::int64_t(kernel::LpId)> cost_from_counters(const Worlds& worlds) {
  struct Reading {
    physics::StageCounters stages;
    WorldCounters worlds;
  };
  return [&worlds, last = std::vector<Reading>(worlds.size())](kernel::LpId lp) mutable {
    const World& world = static_cast<const World&>(*worlds[kernel::index_of(lp)]);
    Reading& reading = last[kernel::index_of(lp)];
    const std::int64_t cost_ns =
        work_cost_ns(reading.stages, world.stages(), reading.worlds, world.counters());
    reading = {world.stages(), world.counters()};
    return cost_ns;
  };
}

kernel::RunResult run_on_cluster(const Worlds& worlds, const RunOptions& options,
                                 const kernel::ProgressFn& progress,
                                 std::optional<kernel::VirtualReport>& report) {
  kernel::VirtualOptions cluster = options.cluster;
  cluster.window = options.buffer;
  cluster.synchronisation = options.synchronisation;
  if (!options.constant_cost) cluster.cost_ns = cost_from_counters(worlds);
  kernel::VirtualResult result =
      kernel::run_virtual(worlds, time_of(options.steps, Phase::kBegin), cluster, progress);
  report = result.report;
  return std::move(result.run);
}

kernel::RunResult run(const Worlds& worlds, const RunOptions& options,
                      const kernel::ProgressFn& progress,
                      std::optional<kernel::VirtualReport>& report) {
  const kernel::VirtualTime end = time_of(options.steps, Phase::kBegin);
  if (options.executor == ExecutorKind::kVirtual)
    return run_on_cluster(worlds, options, progress, report);
  // One world has nobody to run ahead of: it needs no history.
  if (options.executor == ExecutorKind::kSequential || worlds.size() == 1) {
    return kernel::run_sequential(worlds, end, progress);
  }
  return kernel::run_threads(worlds, end,
                             {.threads = options.threads,
                              .window = options.buffer,
                              .scheduling_seed = options.scheduling_seed,
                              .synchronisation = options.synchronisation},
                             progress);
}

void add(const WorldCounters& from, WorldCounters& to) {
  to.border_tests += from.border_tests;
  to.ghosts_sent += from.ghosts_sent;
  to.fragments_sent += from.fragments_sent;
  to.records_sent += from.records_sent;
  to.merge_rounds += from.merge_rounds;
  to.migrations += from.migrations;
  to.mixed_islands += from.mixed_islands;
  to.islands_reused += from.islands_reused;
  to.entries_saved += from.entries_saved;
  to.bytes_sent += from.bytes_sent;
}

void collect(const Worlds& worlds, std::size_t bodies, SimulationResult& result) {
  result.final_states.resize(bodies);
  for (const std::unique_ptr<kernel::LogicalProcess>& process : worlds) {
    World& world = static_cast<World&>(*process);
    result.stages += world.stages();
    add(world.counters(), result.worlds);
    const BufferEntry& entry = world.newest_entry();
    for (std::size_t i = 0; i < entry.ids.size(); ++i) {
      result.final_states[physics::index_of(entry.ids[i])] = entry.states[i];
    }
  }
}

// A run that failed ends with worlds at or beyond the fault. What was committed last is what a run
// of only the committed steps ends with.
std::vector<physics::BodyState> committed_states(const physics::SceneDescription& scene,
                                                 std::span<const physics::BodyState> initial,
                                                 const TerritoryMap& map, RunOptions options,
                                                 std::int64_t committed_steps) {
  options.steps = committed_steps;
  options.executor = ExecutorKind::kSequential;
  return simulate(scene, initial, map, options).final_states;
}

}  // namespace

SimulationResult simulate(const physics::SceneDescription& scene,
                          std::span<const physics::BodyState> initial, const TerritoryMap& map,
                          const RunOptions& options, const CommitObserver& observer,
                          const std::function<void(const Progress&)>& progress) {
  const physics::Geometry geometry(scene);
  std::deque<SolveShare> shares;
  for (std::size_t i = 0; i < share_count(options, map.worlds()); ++i)
    shares.emplace_back(options.buffer + 1);
  CommitMerge commits(observer, map.worlds());
  const Worlds worlds =
      build_worlds({scene, geometry, map, shares, commits}, initial, options.buffer);

  kernel::ProgressFn on_gvt;
  if (progress) {
    on_gvt = [&](kernel::VirtualTime gvt, const kernel::Counters& so_far) {
      const double executed = static_cast<double>(std::max<std::uint64_t>(so_far.executed, 1));
      progress({.committed_step = std::min(gvt.t, options.steps),
                .efficiency = 1.0 - static_cast<double>(so_far.rolled_back) / executed});
    };
  }
  SimulationResult result;
  const kernel::RunResult outcome = run(worlds, options, on_gvt, result.cluster);
  result.committed_steps = commits.committed_steps();
  result.islands_committed = commits.islands();
  result.events = outcome.counters;
  collect(worlds, initial.size(), result);
  if (outcome.fault) {
    const std::uint64_t body = outcome.fault->fault.subject;
    result.fault = SimulationFault{.step = outcome.fault->when.t,
                                   .world = WorldId{kernel::index_of(outcome.fault->lp)},
                                   .body_label = scene.bodies[body].label,
                                   .what = outcome.fault->fault.what};
    result.final_states = committed_states(scene, initial, map, options, result.committed_steps);
  }
  return result;
}

}  // namespace soda::models
