// What work costs on one machine, and the file that holds it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "analysis/calibration/cost_fit.hpp"
#include "models/options/cost_weights.hpp"

namespace soda::analysis {

struct MachineCosts {
  std::string machine;  // the processor's name
  CostFactors factors = usual_factors();
  double gvt_ns = 1000.0;       // a worker's part of a round, commits included
  std::int64_t processors = 1;  // that work at the same time in the next
  double slow_down = 1.0;       // >= 1: work takes so much longer then: caches, memory, clock
};

// The usual weights on this machine while so many processors work.
models::CostWeights weights_for(const MachineCosts& costs, std::size_t processors);

std::string machine_costs_json(const MachineCosts& costs);

// Throws scenarios::FileError, and scenarios::InputError that tells all faults of the file.
MachineCosts read_machine_costs(const std::string& file);

}  // namespace soda::analysis
