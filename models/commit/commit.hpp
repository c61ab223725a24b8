// What a run tells of itself as it commits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "models/territory/territory.hpp"
#include "models/user_input/user_input.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/ids.hpp"
#include "physics/model/island_report.hpp"

namespace soda::models {

// The state after `step` steps, complete over all worlds and final.
struct CommittedStep {
  std::int64_t step = 0;                 // first_step + 1 .. steps
  std::span<const physics::BodyId> ids;  // those that are there; empty unless states are wanted
  std::span<const physics::BodyState> states;
  std::span<const WorldId> owners;                 // of each body during this step
  std::span<const physics::IslandReport> islands;  // ascending by label, each island once
  std::span<const CommittedInput> inputs;  // of the step's beginning, in the order of acting
  std::span<const TerritoryChange> territory_changes;  // of the step's beginning
};

// Where a world stands that may yet be rolled back: its bodies at the start of the step in
// progress.
struct WorldStand {
  WorldId world{};
  std::int64_t step = 0;  // after so many
  std::vector<physics::BodyId> ids;
  std::vector<physics::BodyState> states;  // of ids
};

struct CommitObserver {
  // Whether on_step needs ids, states and owners; what nobody wants is not gathered. If it does, of
  // the steps that `states_every` (>= 1) divides.
  bool wants_states = false;
  std::int64_t states_every = 1;
  bool wants_states_of(std::int64_t step) const { return wants_states && step % states_every == 0; }
  // Called in order of steps, one call at a time, from any worker thread.
  std::function<void(const CommittedStep&)> on_step;
  // Whether the life of every event is written down, for on_trace.
  bool wants_trace = false;
  // A chunk for kernel::TraceChunk; called from any worker thread, in order of those of a worker.
  std::function<void(std::span<const std::byte>)> on_trace = {};
  // Called once for each world, at the end of a recorded run that is not whole.
  std::function<void(WorldStand)> on_stand = {};
};

}  // namespace soda::models
