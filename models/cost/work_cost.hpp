// What work costs on a virtual processor: a function of counters, so that it is the same
// everywhere.
//
// Work that stands belongs to one of (kernel::ExecutionCost):
// - useful: what the undivided run does. A mixed island is useful on the processor of the world
//   that owns its label, and the events of a step on the first world.
// - replicated: mixed islands that the others solve, too, and pairs that somebody else tests. Rows
//   of a border in a split island, which two solvers share, count as useful twice.
// - division: border tests, and the packing and unpacking of ghosts, contacts, records and
//   migrants; the events of all other worlds; samples of load.
// - checkpoints: entries stored and read. In lockstep nobody goes back, so none are charged.
// - sending: bytes that leave a world.
// GVT and commits are charged by processor, beside executions. What an event that is executed again
// takes over from the one that it replaces was paid there: it counts as rolled back.
#pragma once

#include <cstdint>

#include "kernel/api/executor.hpp"
#include "kernel/api/time_account.hpp"
#include "models/options/cost_weights.hpp"
#include "models/options/world_counters.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::models {

// A reading of a world's counters.
struct WorkReading {
  physics::StageCounters stages;
  physics::StageCounters replicated;  // of these, what another processor does, too
  WorldCounters worlds;
};

// Modelled time of the work of one event, between two readings (`before` <= `after`). Never 0: even
// an event without work is scheduled and takes in its bag. How well the weights fit real times is
// in docs/decisions/models-modelled-cost.md.
kernel::ExecutionCost work_cost(const WorkReading& before, const WorkReading& after,
                                kernel::Synchronisation synchronisation,
                                const CostWeights& weights = {});

// The measured time of executions that stand, which is all `useful`, divided as the work is.
kernel::ExecutionCost divided_as(const WorkReading& work, kernel::ExecutionCost standing);

// The sum of a run of one world in sequence: what one processor takes.
std::int64_t undivided_cost_ns(std::uint64_t events, const physics::StageCounters& stages,
                               const CostWeights& weights = {});

// Parts of it by the usual weights, to tell beforehand what bodies and islands will cost: a body by
// itself, a pair of shapes tested, a contact point found, a record told, and an island solved.
std::int64_t body_cost_ns();
std::int64_t test_cost_ns(physics::ShapeKernel kernel);
std::int64_t point_cost_ns();
std::int64_t record_cost_ns();
// (`multiplications` are those of the island's factorisations)
std::int64_t solve_cost_ns(std::uint32_t contact_points, std::uint64_t iterations,
                           std::uint64_t multiplications);

// Of the joints of an island in a step: their rows, in chains; and their factorisations, each with
// so many multiplications, which count where rows have more in common than in chains.
std::int64_t joint_rows_cost_ns(std::uint64_t rows);
std::int64_t joint_factors_cost_ns(std::uint64_t multiplications);

// A sweep over the rows of so many contact points.
std::int64_t sweep_cost_ns(std::uint64_t contact_points);

}  // namespace soda::models
