#include "models/run/simulation.hpp"

#include <algorithm>
#include <deque>
#include <memory>
#include <utility>

#include "kernel/api/partition.hpp"
#include "kernel/executors/distributed_executor.hpp"
#include "models/commit/commit_merge.hpp"
#include "models/cost/work_cost.hpp"
#include "models/islands/solve_share.hpp"
#include "models/islands/split_plan.hpp"
#include "models/load_balancing/balancing.hpp"
#include "models/options/run_stages.hpp"
#include "models/run/commit_forwarding.hpp"
#include "models/run/recorded_run.hpp"
#include "models/territory/map_share.hpp"
#include "models/user_input/input_feed.hpp"
#include "models/world/event_kinds.hpp"
#include "models/world/world.hpp"

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
  const physics::Geometry& geometry;
  std::deque<SolveShare>& shares;
  SceneVersions& scenes;
  MapShare& maps;
  CommitSink& commits;
  const RunOptions& options;
  LoadSampling sampling;
  LoadSink* loads;
  std::span<const std::uint32_t> processors;  // of worlds; outlives them
};

bool is_root(const RunOptions& options) {
  return options.executor != ExecutorKind::kMpi || options.transport->is_root();
}

// The worlds that live in this process.
kernel::LpRange own_worlds(const RunOptions& options, std::uint32_t worlds) {
  if (options.executor != ExecutorKind::kMpi) return {0, worlds};
  if (worlds == 1) return {0, is_root(options) ? 1u : 0u};
  return kernel::own_lps(*options.transport, options.threads, worlds);
}

// Null if territories stay as they are; one world has nobody to give to.
std::unique_ptr<Balancing> make_balancing(const RunOptions& options,
                                          const std::shared_ptr<const TerritoryMap>& map) {
  if (options.recorded != nullptr || !balancing_needed(options, map->worlds())) return nullptr;
  return std::make_unique<Balancing>(options.balancing, map, processors_of(options, map->worlds()),
                                     options.buffer, options.first_step, options.steps);
}

LoadSampling sampling_of(const Balancing* balancing, const RunOptions& options) {
  LoadSampling sampling = balancing != nullptr ? balancing->sampling() : LoadSampling{};
  sampling.splits_islands = splits_islands(options);
  return sampling;
}

// Every body starts in the world that owns its centre. Worlds that live elsewhere are null.
Worlds build_worlds(const Surroundings& around, const Rules& rules,
                    std::span<const physics::BodyState> initial, kernel::LpRange own) {
  const RunOptions& options = around.options;
  std::vector<BufferEntry> entries(rules.map->worlds());
  const bool undivided = entries.size() == 1;
  if (undivided) {
    entries[0].ids.reserve(initial.size());
    entries[0].states.reserve(initial.size());
  }
  for (std::uint32_t body = 0; body < initial.size(); ++body) {
    if (!rules.inputs->presence.has(physics::BodyId{body})) continue;
    const std::uint32_t owner =
        undivided ? 0 : index_of(rules.map->owner_at(initial[body].position_m));
    BufferEntry& entry = entries[owner];
    entry.ids.push_back(physics::BodyId{body});
    entry.states.push_back(initial[body]);
  }
  const kernel::Partition partition{entries.size(), around.shares.size()};
  const bool over_ranks = options.executor == ExecutorKind::kMpi;
  const kernel::Partition processes{entries.size(),
                                    over_ranks ? options.transport->size() : around.shares.size()};
  const bool splits = splits_needed(*rules.scene, options, rules.map->worlds()).is_needed;
  const auto processors = splits ? around.processors : std::span<const std::uint32_t>{};
  Worlds worlds(entries.size());
  for (std::uint32_t id = own.first; id < own.last; ++id) {
    entries[id].step = options.first_step;
    entries[id].rules = rules;
    SolveShare& share = around.shares[partition.owner_of(kernel::LpId{id})];
    worlds[id] = std::make_unique<World>(
        WorldSurroundings{.geometry = around.geometry,
                          .solves = share,
                          .scenes = around.scenes,
                          .maps = around.maps,
                          .commits = around.commits,
                          .rollback = options.rollback,
                          .gating = options.gating,
                          .processes = processes,
                          .processors = processors,
                          .exchange_ns = exchange_ns(options),
                          .ghosts = options.ghosts,
                          .audits = options.executor == ExecutorKind::kVirtual ||
                                    options.ghosts != GhostMode::kReceivedOnly,
                          .sampling = around.sampling,
                          .loads = around.loads,
                          .entries = options.entries},
        WorldId{id}, options.buffer, std::move(entries[id]));
  }
  return worlds;
}

// Asked once after each event of a world: what its counters say has been done since.
std::function<kernel::ExecutionCost(kernel::LpId)> cost_from_counters(
    const Worlds& worlds, kernel::Synchronisation synchronisation, const CostWeights& weights) {
  return [&worlds, synchronisation, weights,
          last = std::vector<WorkReading>(worlds.size())](kernel::LpId lp) mutable {
    const WorkReading now = static_cast<const World&>(*worlds[kernel::index_of(lp)]).work();
    WorkReading& before = last[kernel::index_of(lp)];
    const kernel::ExecutionCost cost = work_cost(before, now, synchronisation, weights);
    before = now;
    return cost;
  };
}

// Passes on what the workers of this process, or other ranks, have written down.
struct TraceToObserver final : kernel::TraceSink {
  explicit TraceToObserver(const CommitObserver& to) : observer(to) {}
  void take(kernel::Bytes chunk) override { observer.on_trace(chunk); }

  const CommitObserver& observer;
};

// What the kernel drives the worlds for, and with.
struct Driver {
  const RunOptions& options;
  const CommitObserver& observer;
  kernel::ExternalSource* external;
  kernel::Recording recording;
  const kernel::ProgressFn progress;
};

kernel::ThreadsOptions threads_options(const Driver& driver) {
  const RunOptions& options = driver.options;
  return {.threads = options.threads,
          .window = options.buffer,
          .scheduling_seed = options.scheduling_seed,
          .synchronisation = options.synchronisation,
          .external = driver.external,
          .stop = options.stop,
          .recording = driver.recording};
}

kernel::RunResult run_on_cluster(const Worlds& worlds, const Driver& driver,
                                 std::optional<kernel::VirtualReport>& report) {
  const RunOptions& options = driver.options;
  kernel::VirtualOptions cluster = options.cluster;
  cluster.window = options.buffer;
  cluster.synchronisation = options.synchronisation;
  cluster.external = driver.external;
  cluster.stop = options.stop;
  cluster.recording = driver.recording;
  if (!options.constant_cost) {
    cluster.cost = cost_from_counters(worlds, options.synchronisation, options.weights);
    cluster.gvt_cost_ns = options.weights.gvt_ps / 1000;
    cluster.commit_cost_ns = options.weights.commit_ps / 1000;
  }
  if (options.event_cost_ns)
    cluster.cost = [&options, own = cluster.cost](kernel::LpId lp) {
      kernel::ExecutionCost cost =
          own ? own(lp) : kernel::ExecutionCost{.useful_ns = options.cluster.bag_cost_ns};
      const std::int64_t own_ns = cost.sum_ns();
      cost.useful_ns += options.event_cost_ns(WorldId{kernel::index_of(lp)}, own_ns) - own_ns;
      return cost;
    };
  kernel::VirtualResult result =
      kernel::run_virtual(worlds, time_of(options.steps, Phase::kBegin), cluster, driver.progress);
  report = result.report;
  return std::move(result.run);
}

kernel::RunResult run_over_ranks(const Worlds& worlds, const Driver& driver,
                                 CommitForwarding& forwarding, const RecordSinks& sinks) {
  const kernel::RecordHooks records = record_hooks(forwarding, sinks);
  return kernel::run_distributed(worlds, time_of(driver.options.steps, Phase::kBegin),
                                 threads_options(driver), *driver.options.transport, records,
                                 driver.progress);
}

// Worlds may be ahead of what was committed when a run was stopped, and so may territories.
void end_early(const kernel::RunResult& outcome, const Worlds& worlds, SimulationResult& result) {
  result.stopped = outcome.stopped;
  if (result.stopped == 0) return;
  const std::int64_t steps = steps_before(outcome.stopped_at);
  for (const std::unique_ptr<kernel::LogicalProcess>& process : worlds)
    if (process) static_cast<World&>(*process).end_after(steps);
  std::erase_if(result.territory_changes,
                [steps](const TerritoryChange& change) { return change.step >= steps; });
}

void add_outcomes(const Worlds& worlds, const RunOptions& options, std::size_t bodies,
                  SimulationResult& result) {
  if (options.executor != ExecutorKind::kMpi || worlds.size() == 1) {
    for (const std::unique_ptr<kernel::LogicalProcess>& process : worlds)
      if (process) add_outcome(static_cast<World&>(*process), bodies, result);
    return result.final_states.resize(bodies);
  }
  result.final_states.resize(bodies);
  for (const kernel::Bytes& outcome : options.transport->gather(encode_outcome(worlds)))
    add_outcome(outcome, result);
}

void collect(const Worlds& worlds, const RunOptions& options, std::size_t bodies,
             SimulationResult& result) {
  add_outcomes(worlds, options, bodies, result);
  if (!std::ranges::is_sorted(result.final_ids)) std::ranges::sort(result.final_ids);
  if (!result.account) return;
  kernel::ExecutionCost& standing = result.account->standing;
  standing = divided_as({result.stages, result.replicated, result.worlds}, standing);
}

void take_sums(const kernel::RunResult& outcome, SimulationResult& result) {
  result.events = outcome.counters;
  result.kinds = outcome.kinds;
  result.account = outcome.account;
}

kernel::RunResult run(const Worlds& worlds, const Driver& driver, CommitForwarding& forwarding,
                      const RecordSinks& sinks, std::optional<kernel::VirtualReport>& report) {
  const RunOptions& options = driver.options;
  const kernel::VirtualTime end = time_of(options.steps, Phase::kBegin);
  if (options.recorded != nullptr)
    return run_recorded(worlds, options, driver.recording, driver.observer);
  if (options.executor == ExecutorKind::kVirtual) return run_on_cluster(worlds, driver, report);
  if (worlds.size() == 1 && !worlds[0]) return {};
  if (executor_of(options, static_cast<std::uint32_t>(worlds.size())) == ExecutorKind::kSequential)
    return kernel::run_sequential(worlds, end, driver.progress, driver.external, options.stop,
                                  driver.recording);
  if (options.executor == ExecutorKind::kMpi)
    return run_over_ranks(worlds, driver, forwarding, sinks);
  return kernel::run_threads(worlds, end, threads_options(driver), driver.progress);
}

// Threads and ranks tell where their time goes.
kernel::Recording recording_of(const RunOptions& options, kernel::TraceSink* trace) {
  return {.kind_of = kind_of,
          .trace = trace,
          .describe = note_bodies,
          .accounts =
              options.executor == ExecutorKind::kThreads || options.executor == ExecutorKind::kMpi};
}

kernel::ProgressFn on_gvt(std::int64_t steps,
                          const std::function<void(const Progress&)>& progress) {
  if (!progress) return {};
  return [steps, &progress](kernel::VirtualTime gvt, const kernel::Counters& so_far) {
    const double executed = static_cast<double>(std::max<std::uint64_t>(so_far.executed, 1));
    progress({.committed_step = std::min(gvt.t, steps),
              .efficiency = 1.0 - static_cast<double>(so_far.rolled_back) / executed});
  };
}

SimulationFault fault_of(const kernel::CommittedFault& committed,
                         const physics::SceneDescription& scene) {
  return {.step = committed.when.t,
          .world = WorldId{kernel::index_of(committed.lp)},
          .body_label = scene.bodies[committed.fault.subject].label,
          .what = committed.fault.what};
}

// A run that failed ends with worlds at or beyond the fault. What was committed last is what a run
// of only the committed steps ends with.
SimulationResult run_committed(const physics::SceneDescription& scene,
                               std::span<const physics::BodyState> initial, const TerritoryMap& map,
                               RunOptions options, const SimulationResult& failed) {
  options.steps = failed.committed_steps;
  options.balancing = {};
  options.executor = ExecutorKind::kSequential;
  options.external_sources.clear();
  options.entries = nullptr;
  options.stop = nullptr;
  options.inputs.live = nullptr;
  options.inputs.script.clear();
  for (const CommittedInput& committed : failed.inputs)
    options.inputs.script.push_back(committed.input);
  return simulate(scene, initial, map, options);
}

void take_inputs(InputFeed* feed, SimulationResult& result) {
  if (feed == nullptr) return;
  result.inputs = feed->acted();
  result.inputs_too_late = feed->too_late();
}

// Inputs come from outside, and committed steps tell which ones acted. Nothing without inputs.
std::unique_ptr<InputFeed> connect_inputs(std::uint32_t worlds, RunOptions& options,
                                          CommitObserver& observer) {
  if (!options.inputs.any() || !is_root(options)) return nullptr;
  // Before a world within its buffer can come to their step.
  const std::int64_t ahead_steps = options.inputs.at_the_last_moment ? 0 : 2 * options.buffer + 2;
  auto feed = std::make_unique<InputFeed>(options.inputs, worlds, options.first_step, ahead_steps);
  options.external_sources.push_back(feed.get());
  observer.on_step = [&from = *feed, on_step = observer.on_step](const CommittedStep& step) {
    CommittedStep whole = step;
    whole.inputs = from.committed(step.step - 1);
    if (on_step) on_step(whole);
  };
  return feed;
}

// Committed steps tell which cells changed hands, now or in the recorded run.
void connect_changes(Balancing* balancing, const RecordedExecution* recorded,
                     CommitObserver& observer) {
  if (!observer.on_step || (balancing == nullptr && recorded == nullptr)) return;
  observer.on_step = [=, on_step = observer.on_step](const CommittedStep& step) {
    const std::vector<TerritoryChange> changes =
        balancing != nullptr ? balancing->changes_at(step.step - 1)
                             : changes_at(recorded->territory_changes, step.step - 1);
    CommittedStep whole = step;
    whole.territory_changes = changes;
    on_step(whole);
  };
}

}  // namespace

SimulationResult simulate(const physics::SceneDescription& scene,
                          std::span<const physics::BodyState> initial, const TerritoryMap& map,
                          const RunOptions& given, const CommitObserver& given_observer,
                          const std::function<void(const Progress&)>& progress) {
  RunOptions options = given;
  CommitObserver observer = given_observer;
  const std::unique_ptr<InputFeed> feed = connect_inputs(map.worlds(), options, observer);
  const physics::Geometry geometry(scene);
  std::deque<SolveShare> shares;
  for (std::size_t i = 0; i < share_count(options, map.worlds()); ++i)
    shares.emplace_back(options.buffer + 1);
  CommitMerge merge(observer, map.worlds(), options.first_step);
  CommitForwarding forwarding(observer);
  CommitSink& commits = is_root(options) ? static_cast<CommitSink&>(merge) : forwarding;
  SceneVersions scenes(scene);
  MapShare maps;
  const Rules rules{
      std::shared_ptr<const TerritoryMap>(std::shared_ptr<const void>(), &map), scenes.with({}),
      std::make_shared<InputAccount>(InputAccount{Presence(options.inputs.absent), {}})};
  const std::unique_ptr<Balancing> balancing = make_balancing(options, rules.map);
  if (balancing && is_root(options)) options.external_sources.push_back(balancing.get());
  if (is_root(options)) connect_changes(balancing.get(), options.recorded, observer);
  LoadSink* const loads = is_root(options) ? static_cast<LoadSink*>(balancing.get()) : &forwarding;
  const std::vector<std::uint32_t> processors = processors_of(options, map.worlds());
  const Worlds worlds = build_worlds({geometry, shares, scenes, maps, commits, options,
                                      sampling_of(balancing.get(), options), loads, processors},
                                     rules, initial, own_worlds(options, map.worlds()));

  SimulationResult result;
  kernel::ExternalSourceList external_sources(options.external_sources);
  TraceToObserver to_observer(observer);
  kernel::TraceSink* const trace =
      is_root(options) ? static_cast<kernel::TraceSink*>(&to_observer) : &forwarding;
  const kernel::RunResult outcome =
      run(worlds,
          {.options = options,
           .observer = observer,
           .external = options.external_sources.empty() ? nullptr : &external_sources,
           .recording = recording_of(options, observer.wants_trace ? trace : nullptr),
           .progress = on_gvt(options.steps, progress)},
          forwarding, {commits, balancing.get(), trace, options.entries}, result.cluster);
  result.committed_steps = merge.committed_steps();
  if (options.recorded != nullptr) {
    if (!options.recorded->order.whole) return result;
    result.territory_changes = options.recorded->territory_changes;
  }
  if (balancing) result.territory_changes = balancing->changes();
  end_early(outcome, worlds, result);
  result.islands_committed = merge.islands();
  take_sums(outcome, result);
  collect(worlds, options, initial.size(), result);
  take_inputs(feed.get(), result);
  if (!outcome.fault) return result;
  result.fault = fault_of(*outcome.fault, scene);
  if (is_root(options)) {
    SimulationResult committed = run_committed(scene, initial, map, options, result);
    result.final_states = std::move(committed.final_states);
    result.final_ids = std::move(committed.final_ids);
  }
  return result;
}

}  // namespace soda::models
