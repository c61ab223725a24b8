#include "models/options/cost_weights.hpp"

#include <cmath>

namespace soda::models {

const char* name_of(CostGroup group) {
  constexpr std::array<const char*, kCostGroups> kNames = {
      "events",  "bodies", "tests",   "points",   "sweeps",
      "factors", "joints", "impacts", "division", "checkpoints"};
  return kNames[static_cast<std::size_t>(group)];
}

CostWeights scaled(const CostWeights& weights, const std::array<double, kCostGroups>& factors) {
  CostWeights result = weights;
  const auto scale = [&factors](CostGroup group, auto&... ps) {
    const double factor = factors[static_cast<std::size_t>(group)];
    ((ps = static_cast<std::int64_t>(std::round(factor * static_cast<double>(ps)))), ...);
  };
  scale(CostGroup::kEvents, result.event_ps);
  scale(CostGroup::kBodies, result.body_ps, result.drive_ps);
  scale(CostGroup::kTests, result.pair_ps);
  for (std::int64_t& test_ps : result.test_ps) scale(CostGroup::kTests, test_ps);
  scale(CostGroup::kPoints, result.contact_point_ps);
  scale(CostGroup::kSweeps, result.island_ps, result.row_iteration_ps);
  scale(CostGroup::kFactors, result.multiplication_ps);
  scale(CostGroup::kJoints, result.joint_row_ps);
  scale(CostGroup::kImpacts, result.impact_search_ps);
  scale(CostGroup::kDivision, result.border_test_ps, result.record_ps, result.sampled_body_ps);
  scale(CostGroup::kCheckpoints, result.stored_entry_ps, result.stored_body_ps);
  return result;
}

}  // namespace soda::models
