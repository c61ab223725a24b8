// Who gives which cells to whom: load balancing as functions of what has been measured.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "models/load_balancing/load_sample.hpp"
#include "models/territory/territory.hpp"

namespace soda::models {

// Steps that a ring of `entries` lasts when each step takes `ratio` times as long as whoever uses
// the entries needs: B r / (r - 1), the anticipation benefit; infinite for ratio <= 1.
double anticipation_steps(double entries, double ratio);

// What all worlds together have to do in a step, by place in space.
struct LoadPicture {
  struct Island {
    std::int64_t solve_ns = 0;         // by each world that has a part of it
    std::int64_t telling_ns = 0;       // of all of it, to one world
    std::vector<std::uint32_t> cells;  // ascending
    bool is_shared_out = false;        // the solve: all who have a part do it together
  };
  std::vector<std::int64_t> cell_ns;  // of each cell, without solves of islands
  std::vector<Island> islands;        // of more than one body, or with a solve
  std::vector<std::int64_t> entries;  // of each world: in store
};

// `samples`: one of each world, of one step.
LoadPicture picture_of(std::span<const LoadSample> samples, std::size_t cells);

struct BalancerOptions {
  double tolerance = 0.15;       // load above the neighbours' mean that is left alone
  double split_factor = 2.0;     // what an island of several owners costs each of them; >= 1
  double telling_share = 0.3;    // of telling a shared-out island that each owner costs each owner
  double border_share = 0.5;     // of the load of the cells at a border face, for either side more
  std::size_t most_cells = 256;  // that are moved in one decision
  std::int64_t delay = 0;        // steps until a decision holds
};

// The paper's scheme (section 3.4.2), on committed data. A world that is loaded more than its
// neighbours, or has part of an island that another processor has part of, too, aims at the mean
// of its neighbourhood; the difference is its score. It ranks its neighbours, the least loaded
// first, and gives them cells, the most interesting first, until it has reached its score. What is
// interesting is what lowers the sum of the squared loads of processors most, borders included.
// Territories keep their pieces together, and nobody gives its last cell.
//
// How much more load is too much follows from the anticipation benefit: a world whose store lasts
// longer than a decision takes can wait, one whose store is used up cannot.
//
// `processor_of`: of each world; cells do not move within a processor. Empty if nothing is gained.
std::vector<CellTransfer> paper_transfers(const LoadPicture& picture, const TerritoryMap& map,
                                          std::span<const std::uint32_t> processor_of,
                                          const BalancerOptions& options);

// For tests: up to `most` cells go to any neighbour, territories in one piece as above.
std::vector<CellTransfer> random_transfers(const TerritoryMap& map, std::size_t most,
                                           kernel::SplitMix64& random);

}  // namespace soda::models
