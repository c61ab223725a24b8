// What work costs on a virtual processor: a function of counters, so that it is the same
// everywhere.
#pragma once

#include <cstdint>

#include "models/simulation.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::models {

// Modelled time of the work between two readings of a world's counters (`before` <= `after`).
// Never 0: even an event without work is scheduled and takes in its bag. How well the weights fit
// real times is in README.md, "Modelled cost".
std::int64_t work_cost_ns(const physics::StageCounters& before, const physics::StageCounters& after,
                          const WorldCounters& worlds_before, const WorldCounters& worlds_after);

// Parts of it, to tell beforehand what bodies and islands will cost: a body by itself, a pair of
// shapes tested, a contact point found, a record told, and an island solved.
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
