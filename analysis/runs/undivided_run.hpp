// What speed-ups are measured against: one processor that has the whole scene as one world.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "models/run/simulation.hpp"

namespace soda::analysis {

struct UndividedRun {
  std::int64_t cost_ns = 0;  // modelled time of one processor
  std::uint64_t digest = 0;  // of the state after the last step
};

// Runs the undivided scene in sequence, from options.first_step to `steps`, with `inputs`. Costs
// are those of a cluster with `options`.
UndividedRun run_undivided(const physics::SceneDescription& scene,
                           const std::vector<physics::BodyState>& initial,
                           const models::RunOptions& options, std::int64_t steps,
                           const std::vector<models::UserInput>& inputs);

// Its cost for what `run` has committed with `options`: it is executed for that. Nothing if `run`
// was on no virtual cluster, or ended early: who has stopped a run does not wait for another.
std::optional<std::int64_t> one_processor_ns(const physics::SceneDescription& scene,
                                             const std::vector<physics::BodyState>& initial,
                                             const models::RunOptions& options,
                                             const models::SimulationResult& run);

// That over the makespan of `cluster`; nothing if it is not known.
std::optional<double> speed_up(std::optional<std::int64_t> one_processor_ns,
                               const kernel::VirtualReport& cluster);

}  // namespace soda::analysis
