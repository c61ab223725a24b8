// What accuracy mode says of a run: the errors that its steps estimate of themselves. Of committed
// data only, so equal for every way to execute it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"

namespace soda::analysis {

// Estimates are of the width of the body that is off by most, each over one step.
struct ErrorEstimates {
  double tolerance = 0.0;  // of each island in each step
  double largest = 0.0;
  std::int64_t step = 0;                  // that ended with the largest; 0: all are 0
  std::uint32_t island = 0, body = 0;     // labels: of its island's first body, of the worst one
  double sum = 0.0;                       // over the steps, of the largest of each
  std::uint64_t islands = 0, beyond = 0;  // solved in all steps; of them, beyond the tolerance
};

// The islands of one committed step; call in the order of steps.
void add_estimates(const physics::SceneDescription& scene, std::int64_t step,
                   std::span<const physics::IslandReport> islands, ErrorEstimates& estimates);

// Two lines.
std::string estimates_text(const ErrorEstimates& estimates);

}  // namespace soda::analysis
