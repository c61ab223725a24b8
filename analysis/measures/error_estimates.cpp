#include "analysis/measures/error_estimates.hpp"

#include <algorithm>

#include "analysis/text/text_table.hpp"

namespace soda::analysis {

void add_estimates(const physics::SceneDescription& scene, std::int64_t step,
                   std::span<const physics::IslandReport> islands, ErrorEstimates& estimates) {
  const auto label = [&scene](physics::BodyId id) {
    return scene.bodies[physics::index_of(id)].label;
  };
  double most = 0.0;
  for (const physics::IslandReport& island : islands) {
    ++estimates.islands;
    estimates.beyond += island.beyond_tolerance;
    most = std::max(most, island.error_estimate);
    if (!(island.error_estimate > estimates.largest)) continue;
    estimates.largest = island.error_estimate;
    estimates.step = step;
    estimates.island = label(island.label);
    estimates.body = label(island.worst_body);
  }
  estimates.sum += most;
}

std::string estimates_text(const ErrorEstimates& estimates) {
  std::string text = "error estimates, of a body's width: largest of a step " +
                     format_number(estimates.largest, 3);
  if (estimates.step > 0)
    text += " (step " + std::to_string(estimates.step) + ", island of body " +
            std::to_string(estimates.island) + ", body " + std::to_string(estimates.body) + ")";
  return text + ", sum over the steps " + format_number(estimates.sum, 3) + "\n  " +
         std::to_string(estimates.beyond) + " of " + std::to_string(estimates.islands) +
         " islands beyond the tolerance of " + format_number(estimates.tolerance, 3) + "\n";
}

}  // namespace soda::analysis
