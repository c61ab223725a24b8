#include "models/islands/split_plan.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "kernel/api/partition.hpp"
#include "models/cost/work_cost.hpp"
#include "models/options/run_options.hpp"
#include "models/options/run_stages.hpp"
#include "physics/solvers/solve_choice.hpp"

namespace soda::models {
namespace {

using physics::ContactManifold;

// What a processor has of the island.
struct Party {
  WorldId world{};
  std::uint32_t processor = 0;
  std::uint64_t bodies = 0;
  std::uint64_t blocks = 0;  // sum over its bodies
};

bool may_bounce(const physics::SceneDescription& scene,
                std::span<const ContactManifold> manifolds) {
  return std::any_of(manifolds.begin(), manifolds.end(), [&scene](const ContactManifold& m) {
    return physics::material_of(scene, m.a).restitution > 0.0 ||
           physics::material_of(scene, m.b).restitution > 0.0;
  });
}

// Ascending by processor.
std::vector<Party> parties_of(std::span<const WorldId> owners,
                              std::span<const std::uint32_t> processors) {
  std::map<std::uint32_t, Party> parties;
  for (const WorldId owner : owners) {
    const std::uint32_t processor = processors[index_of(owner)];
    Party& party = parties.try_emplace(processor, Party{owner, processor}).first->second;
    party.world = std::min(party.world, owner);
    ++party.bodies;
  }
  std::vector<Party> list;
  list.reserve(parties.size());
  for (const auto& [processor, party] : parties) list.push_back(party);
  return list;
}

// Those with most bodies, in the order of their mean place in the chain.
void choose(std::size_t count, std::vector<Party>& parties) {
  if (parties.size() > count) {
    std::stable_sort(parties.begin(), parties.end(),
                     [](const Party& x, const Party& y) { return x.bodies > y.bodies; });
    parties.resize(count);
  }
  std::sort(parties.begin(), parties.end(), [](const Party& x, const Party& y) {
    const std::uint64_t of_x = x.blocks * y.bodies, of_y = y.blocks * x.bodies;
    return of_x != of_y ? of_x < of_y : x.processor < y.processor;
  });
}

std::vector<std::uint64_t> points_of(std::span<const physics::IslandPart> parts,
                                     std::span<const ContactManifold> manifolds) {
  std::vector<std::uint64_t> points;
  for (const physics::IslandPart& part : parts)
    points.push_back(std::accumulate(
        part.manifolds.begin(), part.manifolds.end(), std::uint64_t{0},
        [&](std::uint64_t sum, std::uint32_t m) { return sum + manifolds[m].count; }));
  return points;
}

std::uint64_t sum_of(std::span<const std::uint64_t> work) {
  return std::accumulate(work.begin(), work.end(), std::uint64_t{0});
}

// Ranges that are as long as a limit allows; a single block may be beyond it.
std::vector<SolverRange> divide_within(std::uint64_t limit, std::span<const std::uint64_t> inside,
                                       std::span<const std::uint64_t> borders) {
  std::vector<SolverRange> ranges;
  const auto behind = [&](std::size_t block) {
    return block < borders.size() ? borders[block] : 0;
  };
  std::uint64_t work = 0;  // without the border behind
  for (std::uint32_t block = 0; block < inside.size(); ++block) {
    const bool fits =
        !ranges.empty() && work + behind(block - 1) + inside[block] + behind(block) <= limit;
    if (fits) {
      work += behind(block - 1) + inside[block];
      ranges.back().last = block + 1;
      continue;
    }
    work = (block > 0 ? behind(block - 1) : 0) + inside[block];
    ranges.push_back({WorldId{}, block, block + 1});
  }
  return ranges;
}

}  // namespace

// Without waiting, a solver would go on without its neighbours in every round; extrapolated ghosts
// need all bodies of an island at its end.
bool splits_islands(const RunOptions& options) {
  return options.split_islands && options.gating && options.ghosts == GhostMode::kReceivedOnly &&
         options.rollback != RollbackMode::kWarm && options.executor != ExecutorKind::kSequential &&
         options.synchronisation == kernel::Synchronisation::kOptimistic;
}

std::vector<std::uint32_t> processors_of(const RunOptions& options, std::uint32_t worlds) {
  std::size_t processors = worlds;
  if (options.executor == ExecutorKind::kThreads) processors = options.threads;
  if (options.executor == ExecutorKind::kVirtual)
    processors = std::min<std::size_t>(options.cluster.processors, worlds);
  // A plan can be asked for before there are ranks: then there is no telling.
  if (options.executor == ExecutorKind::kMpi && options.transport != nullptr)
    processors = std::size_t{options.threads} * options.transport->size();
  const kernel::Partition partition{worlds, processors};
  std::vector<std::uint32_t> of_world(worlds);
  for (std::uint32_t world = 0; world < worlds; ++world)
    of_world[world] = static_cast<std::uint32_t>(partition.owner_of(kernel::LpId{world}));
  return of_world;
}

physics::Need splits_needed(const physics::SceneDescription& scene, const RunOptions& options,
                            std::uint32_t worlds) {
  const physics::Need entries = entries_needed(options, worlds);
  if (!entries) return entries;
  if (worlds == 1) return borders_needed(worlds);
  if (!splits_islands(options)) return {false, "each world solves the whole of its islands"};
  const std::vector<std::uint32_t> processors = processors_of(options, worlds);
  if (processors.front() == processors.back()) return {false, "one processor drives all worlds"};
  if (scene.tolerance > 0.0)
    return {false, "each part of a step to a tolerance has its own blocks"};
  const physics::Need blocks = physics::blocks_needed(scene);
  if (!blocks) return blocks;
  return {true, "worlds solve an island of many contacts together"};
}

std::int64_t exchange_ns(const RunOptions& options) {
  if (options.executor == ExecutorKind::kVirtual)
    return options.cluster.latency_ns + options.cluster.jitter_ns / 2;
  const bool over_ranks = options.executor == ExecutorKind::kMpi ||
                          (options.recorded != nullptr && options.recorded->over_ranks);
  return over_ranks ? 50'000 : 10'000;
}

std::uint64_t largest_work(std::span<const SolverRange> ranges,
                           std::span<const std::uint64_t> inside,
                           std::span<const std::uint64_t> borders) {
  std::uint64_t largest = 0;
  for (const SolverRange& range : ranges) {
    const std::size_t first = range.first > 0 ? range.first - 1 : 0;
    const std::size_t last = std::min<std::size_t>(range.last, borders.size());
    largest = std::max(largest, sum_of(inside.subspan(range.first, range.last - range.first)) +
                                    sum_of(borders.subspan(first, last - first)));
  }
  return largest;
}

std::vector<SolverRange> divide_chain(std::span<const std::uint64_t> inside,
                                      std::span<const std::uint64_t> borders,
                                      std::uint32_t solvers) {
  std::uint64_t low = 0;
  std::uint64_t high = sum_of(inside) + sum_of(borders);
  while (low < high) {
    const std::uint64_t limit = low + (high - low) / 2;
    if (divide_within(limit, inside, borders).size() <= solvers)
      high = limit;
    else
      low = limit + 1;
  }
  return divide_within(high, inside, borders);
}

std::optional<SplitPlan> plan_split(const physics::SceneDescription& scene,
                                    physics::IslandBlocks blocks, std::span<const WorldId> owners,
                                    std::span<const ContactManifold> manifolds,
                                    std::span<const std::uint32_t> processors,
                                    std::int64_t exchange_ns) {
  std::vector<Party> parties = parties_of(owners, processors);
  if (parties.size() < 2 || may_bounce(scene, manifolds)) return std::nullopt;
  SplitPlan plan{std::move(blocks), {}};
  for (std::size_t i = 0; i < owners.size(); ++i) {
    const std::uint32_t processor = processors[index_of(owners[i])];
    std::lower_bound(parties.begin(), parties.end(), processor,
                     [](const Party& party, std::uint32_t p) { return party.processor < p; })
        ->blocks += plan.blocks.block_of[i];
  }
  choose(plan.blocks.count(), parties);
  const std::vector<std::uint64_t> inside = points_of(plan.blocks.inside, manifolds);
  const std::vector<std::uint64_t> borders = points_of(plan.blocks.borders, manifolds);
  plan.solvers = divide_chain(inside, borders, static_cast<std::uint32_t>(parties.size()));
  if (plan.solvers.size() < 2) return std::nullopt;
  const std::uint64_t whole = sum_of(inside) + sum_of(borders);
  const std::uint64_t saved = whole - largest_work(plan.solvers, inside, borders);
  if (sweep_cost_ns(saved) <= exchange_ns) return std::nullopt;
  for (std::size_t i = 0; i < plan.solvers.size(); ++i)
    plan.solvers[i].world = parties[i * parties.size() / plan.solvers.size()].world;
  return plan;
}

}  // namespace soda::models
