// Building the worlds of a scene and running them: what the layers above see of SODA.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "models/commit/commit.hpp"
#include "models/options/run_options.hpp"
#include "models/options/world_counters.hpp"
#include "models/territory/territory.hpp"
#include "models/user_input/user_input.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::models {

struct SimulationFault {
  std::int64_t step = 0;  // the step whose execution failed
  WorldId world{};
  std::uint32_t body_label = 0;
  std::string what;
};

struct SimulationResult {
  // The last of them, from 0; == options.steps unless there was a fault or a stop.
  std::int64_t committed_steps = 0;
  std::uint32_t stopped = 0;  // the request that ended the run early; 0: none did
  std::vector<physics::BodyState> final_states;  // after committed_steps; index == BodyId
  std::vector<physics::BodyId> final_ids;        // ascending; others are absent, their states void
  std::vector<CommittedInput> inputs;            // all that acted, in the order of acting
  std::size_t inputs_too_late = 0;               // others, for which no step was left
  kernel::Counters events;
  kernel::EventCounts kinds;  // as event_kinds.hpp names them
  physics::StageCounters stages;
  physics::StageCounters replicated;  // of these, what another process has done, too
  WorldCounters worlds;
  std::uint64_t islands_committed = 0;
  std::vector<TerritoryChange> territory_changes;  // in order of steps
  std::optional<kernel::VirtualReport> cluster;    // kVirtual only
  // Where the workers' time has gone: kThreads and kMpi. What stands is measured as a whole, and
  // divided as the counted work of all executions is, by the costs of work_cost.hpp.
  std::optional<kernel::TimeAccount> account;
  std::optional<SimulationFault> fault;
};

// Of the final states of the bodies that are there.
std::uint64_t final_digest(const SimulationResult& result);

struct Progress {
  std::int64_t committed_step = 0;
  double efficiency = 1.0;  // 1 - rolled back / executed, so far
};

// Runs the scene, divided by `map`, from options.first_step to options.steps. The committed steps
// are the same bits for every map and every option but the inputs, and wherever a run begins.
// `initial[i]` is the state of BodyId{i} at the first step, void if it is absent; `scene` is as
// inputs before have left it. Over ranks, only the root observes and has the result; elsewhere it
// says no more than whether there was a fault. Of a recorded run that is not whole it has
// committed_steps only.
SimulationResult simulate(const physics::SceneDescription& scene,
                          std::span<const physics::BodyState> initial, const TerritoryMap& map,
                          const RunOptions& options, const CommitObserver& observer = {},
                          const std::function<void(const Progress&)>& progress = {});

}  // namespace soda::models
