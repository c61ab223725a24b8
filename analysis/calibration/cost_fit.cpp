#include "analysis/calibration/cost_fit.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace soda::analysis {

CostFactors usual_factors() {
  CostFactors factors;
  factors.fill(1.0);
  return factors;
}

double fitted_ns(const CostSample& sample, const CostFactors& factors) {
  return std::inner_product(factors.begin(), factors.end(), sample.modelled_ns.begin(), 0.0);
}

namespace {

// How much a factor's distance from that of all work counts, beside the relative error of a run.
constexpr double kPull = 0.003;
constexpr int kSweeps = 200, kRounds = 20;

// The median, so that one run that was disturbed does not move it.
double common_factor(std::span<const CostSample> samples) {
  std::vector<double> ratios;
  for (const CostSample& sample : samples) {
    const double modelled_ns =
        std::accumulate(sample.modelled_ns.begin(), sample.modelled_ns.end(), 0.0);
    if (modelled_ns > 0.0) ratios.push_back(sample.measured_ns / modelled_ns);
  }
  if (ratios.empty()) return 1.0;
  std::ranges::nth_element(ratios, ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2));
  return ratios[ratios.size() / 2];
}

// One of the weighted problem's sweeps of coordinate descent: it is convex, and the bound holds for
// each factor by itself.
void descend(std::span<const CostSample> samples, std::span<const double> weights, double common,
             CostFactors& factors) {
  for (std::size_t group = 0; group < models::kCostGroups; ++group) {
    double curvature = kPull / (common * common);
    double slope = curvature * (common - factors[group]);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double share = samples[i].modelled_ns[group];
      curvature += weights[i] * share * share;
      slope += weights[i] * share * (samples[i].measured_ns - fitted_ns(samples[i], factors));
    }
    factors[group] = std::max(kLeastFactor, factors[group] + slope / curvature);
  }
}

}  // namespace

// A time that is twice too long and one that is half as long as it should be are equally wrong: the
// square of an error counts over the product of both times, that of the fit being the last one's.
CostFactors fit_factors(std::span<const CostSample> samples) {
  const double common = std::max(common_factor(samples), kLeastFactor);
  CostFactors factors;
  factors.fill(common);
  std::vector<double> weights(samples.size());
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      weights[i] = 1.0 / (samples[i].measured_ns * fitted_ns(samples[i], factors));
    for (int sweep = 0; sweep < kSweeps; ++sweep) descend(samples, weights, common, factors);
  }
  return factors;
}

}  // namespace soda::analysis
