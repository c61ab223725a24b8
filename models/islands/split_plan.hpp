// Who solves which blocks of a large island that spans several worlds.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "models/territory/territory.hpp"
#include "physics/model/need.hpp"
#include "physics/model/scene.hpp"
#include "physics/solvers/island_blocks.hpp"

namespace soda::models {

struct RunOptions;

// Whether a run splits large islands between processors, if it has several; and about how long a
// message between them takes. On the virtual cluster that is known, else estimated.
bool splits_islands(const RunOptions& options);
std::int64_t exchange_ns(const RunOptions& options);

// The processor (thread, virtual processor) that drives each world; in sequence, each has its own.
std::vector<std::uint32_t> processors_of(const RunOptions& options, std::uint32_t worlds);

// Whether such a run of this scene may come to split one: what worlds are sent (world.hpp).
physics::Need splits_needed(const physics::SceneDescription& scene, const RunOptions& options,
                            std::uint32_t worlds);

// Blocks [first, last) are solved by the world.
struct SolverRange {
  WorldId world{};
  std::uint32_t first = 0, last = 0;
};

struct SplitPlan {
  physics::IslandBlocks blocks;
  std::vector<SolverRange> solvers;  // two or more, along the chain of blocks
};

// One solver for each processor that has bodies of the island (the lowest of its worlds that has
// one), as long as there are blocks; ranges of about equal work, along the chain in the order in
// which the processors' bodies lie. None if there would be one solver only; if a sweep would
// not save more than the `exchange_ns` that it takes to tell the neighbours; or if something may
// bounce: what that does is known of the whole island only.
//
// `blocks` are those in which physics solves the island (solve_choice.hpp), two or more.
// `owners[i]` owns its body i, `processors[w]` drives world w. All worlds that know the island
// alike make the same plan. It changes who works, not what comes out.
std::optional<SplitPlan> plan_split(const physics::SceneDescription& scene,
                                    physics::IslandBlocks blocks, std::span<const WorldId> owners,
                                    std::span<const physics::ContactManifold> manifolds,
                                    std::span<const std::uint32_t> processors,
                                    std::int64_t exchange_ns);

// The work of the largest range: its blocks and the borders at it.
std::uint64_t largest_work(std::span<const SolverRange> ranges,
                           std::span<const std::uint64_t> inside,
                           std::span<const std::uint64_t> borders);

// Ranges of a chain of blocks, at most `solvers` of them and at least one: the largest range is as
// small as can be. `inside[i]` is the work of block i, `borders[i]` that of its border with the
// next one, which both ranges do if it lies between them.
std::vector<SolverRange> divide_chain(std::span<const std::uint64_t> inside,
                                      std::span<const std::uint64_t> borders,
                                      std::uint32_t solvers);

}  // namespace soda::models
