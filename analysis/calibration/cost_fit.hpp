// Which costs of the virtual cluster come nearest to the times that a machine takes.
#pragma once

#include <array>
#include <span>

#include "models/options/cost_weights.hpp"

namespace soda::analysis {

using CostFactors = std::array<double, models::kCostGroups>;

// All 1.
CostFactors usual_factors();

// One run: what its counted work would cost by the usual weights, by group, and what it took.
struct CostSample {
  std::array<double, models::kCostGroups> modelled_ns{};
  double measured_ns = 0.0;  // > 0
};

// Of the usual weights: least squares of relative errors, none below kLeastFactor. What the
// samples tell nothing of stays near the factor of all work together. Needs a sample.
inline constexpr double kLeastFactor = 0.02;
CostFactors fit_factors(std::span<const CostSample> samples);

// What a sample costs with these factors.
double fitted_ns(const CostSample& sample, const CostFactors& factors);

}  // namespace soda::analysis
