#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "analysis/calibration/calibration_run.hpp"
#include "analysis/runs/overrides.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

namespace fs = std::filesystem;

constexpr auto kGroups = models::kCostGroups;

// Runs whose work is made up, and whose times are those of `truth`.
std::vector<CostSample> made_up(const CostFactors& truth) {
  std::vector<CostSample> samples;
  for (std::size_t run = 0; run < 3 * kGroups; ++run) {
    CostSample sample;
    for (std::size_t group = 0; group < kGroups; ++group)
      sample.modelled_ns[group] = 1e6 * static_cast<double>(1 + (7 * run + 3 * group * run) % 11);
    sample.modelled_ns[run % kGroups] *= 20.0;  // each is the most of some run
    sample.measured_ns = fitted_ns(sample, truth);
    samples.push_back(sample);
  }
  return samples;
}

double squares(std::span<const CostSample> samples, const CostFactors& factors) {
  double sum = 0.0;
  for (const CostSample& sample : samples)
    sum += std::pow(fitted_ns(sample, factors) / sample.measured_ns - 1.0, 2);
  return sum;
}

scenarios::Scenario library_scene(const std::string& name, std::int64_t steps) {
  Overrides overrides;
  overrides.steps = steps;
  return load_scenario(std::string(SODA_SOURCE_DIR) + "/scenarios/library/" + name + ".json",
                       overrides);
}

fs::path file_with(const std::string& name, const std::string& text) {
  const fs::path path = fs::temp_directory_path() / ("soda-costs-" + name + ".json");
  std::ofstream(path) << text;
  return path;
}

TEST(CostFit, FindsTheFactorsThatTimesWereMadeWith) {
  CostFactors truth;
  for (std::size_t group = 0; group < kGroups; ++group)
    truth[group] = 0.5 + 0.3 * static_cast<double>(group);
  const std::vector<CostSample> samples = made_up(truth);
  const CostFactors found = fit_factors(samples);
  for (std::size_t group = 0; group < kGroups; ++group)
    EXPECT_NEAR(found[group], truth[group], 0.1) << group;
  EXPECT_LT(squares(samples, found), 0.01 * squares(samples, usual_factors()));
}

TEST(CostFit, WorkThatNoRunDoesCostsWhatAllWorkCosts) {
  CostSample only_sweeps;
  only_sweeps.modelled_ns[static_cast<std::size_t>(models::CostGroup::kSweeps)] = 1e6;
  only_sweeps.measured_ns = 3e6;
  for (const double factor : fit_factors(std::vector{only_sweeps})) EXPECT_NEAR(factor, 3.0, 1e-6);
}

TEST(MachineCosts, ReadBackAsWritten) {
  MachineCosts costs;
  costs.machine = "a \"machine\"";
  for (std::size_t group = 0; group < kGroups; ++group)
    costs.factors[group] = 0.1 + 1.0 / static_cast<double>(3 + group);
  costs.gvt_ns = 123.25;
  costs.processors = 4;
  costs.slow_down = 1.5;
  const fs::path path = file_with("round", machine_costs_json(costs));
  const MachineCosts read = read_machine_costs(path);
  EXPECT_EQ(read.machine, costs.machine);
  EXPECT_EQ(read.factors, costs.factors);
  EXPECT_EQ(read.gvt_ns, costs.gvt_ns);
  EXPECT_EQ(read.processors, costs.processors);
  EXPECT_EQ(read.slow_down, costs.slow_down);
}

TEST(MachineCosts, AllFaultsOfAFileAreTold) {
  MachineCosts costs;
  costs.machine = "m";
  std::string text = machine_costs_json(costs);
  const auto replace = [&text](const std::string& what, const std::string& with) {
    text.replace(text.find(what), what.size(), with);
  };
  replace("\"events\": 1", "\"events\": -1");
  replace("\"sweeps\"", "\"swepes\"");
  replace("\"slow_down\": 1", "\"slow_down\": \"none\"");
  try {
    read_machine_costs(file_with("faults", text));
    FAIL() << "was read";
  } catch (const scenarios::InputError& error) {
    EXPECT_EQ(error.faults().size(), 4u) << error.what();  // and sweeps are missing
    EXPECT_NE(std::string(error.what()).find("did you mean \"sweeps\"?"), std::string::npos)
        << error.what();
  }
}

TEST(MachineCosts, OneProcessorIsNotSlowedDown) {
  MachineCosts costs;
  costs.processors = 3;
  costs.slow_down = 2.0;
  const models::CostWeights usual;
  EXPECT_EQ(weights_for(costs, 1).record_ps, usual.record_ps);
  EXPECT_EQ(weights_for(costs, 2).record_ps, usual.record_ps * 3 / 2);
  EXPECT_EQ(weights_for(costs, 3).record_ps, 2 * usual.record_ps);
  EXPECT_EQ(weights_for(costs, 30).record_ps, 2 * usual.record_ps);
}

TEST(Calibration, UndividedAndDividedRunsAreMeasuredAndFitted) {
  const Calibration calibration =
      calibrate({library_scene("border-stack", 40), library_scene("pyramid", 5)}, 1, 2);
  std::size_t divided = 0;
  for (const CalibratedRun& run : calibration.runs) {
    EXPECT_GT(run.measured_ns, 0.0) << run.scenario;
    EXPECT_GT(run.usual_ns, 0.0) << run.scenario;
    EXPECT_GT(run.fitted_ns, 0.0) << run.scenario;
    divided += run.worlds > 1;
  }
  EXPECT_GE(divided, 1u);
  EXPECT_GE(calibration.costs.slow_down, 1.0);
  EXPECT_EQ(calibration.costs.processors, 2);
}

TEST(Calibration, APredictionIsOfTheSameRun) {
  const scenarios::Scenario scene = library_scene("border-stack", 60);
  const Prediction prediction = predict(scene, MachineCosts{}, 1.0, 2, 1);
  EXPECT_TRUE(prediction.equal);
  EXPECT_EQ(prediction.threads, 2u);
  EXPECT_GT(prediction.predicted_ns, 0.0);
  EXPECT_GT(prediction.measured_ns, 0.0);
  MachineCosts slower;
  for (double& factor : slower.factors) factor = 10.0;
  EXPECT_GT(predict(scene, slower, 1.0, 2, 1).predicted_ns, 5.0 * prediction.predicted_ns);
  EXPECT_GT(predict(scene, MachineCosts{}, 10.0, 2, 1).predicted_ns, 5.0 * prediction.predicted_ns);
}

// Whatever the costs say, what is predicted is about what the scene's own work takes.
TEST(Calibration, AScenesOwnFactorMakesUpForWrongCosts) {
  const scenarios::Scenario scene = library_scene("border-stack", 100);
  MachineCosts slower;
  for (double& factor : slower.factors) factor = 10.0;
  const double usual = own_factor(scene, MachineCosts{}, 5),
               of_slower = own_factor(scene, slower, 5);
  EXPECT_GT(of_slower, 0.0);
  EXPECT_NEAR(usual / of_slower, 10.0, 5.0);
}

}  // namespace
}  // namespace soda::analysis
