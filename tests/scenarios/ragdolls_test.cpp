// Dolls that tumble down stairs: how far limbs come apart and sink into things.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "physics/model/joint.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/step/step.hpp"
#include "scenarios/read_scenario.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

using namespace physics;

double largest_gap_m(const SceneDescription& scene, const std::vector<BodyState>& states) {
  double largest = 0.0;
  for (const Joint& joint : scene.joints) {
    const BodyState &a = states[index_of(joint.a)], &b = states[index_of(joint.b)];
    const Vec3 at_a = a.position_m + a.orientation * joint.anchor_a_m;
    const Vec3 at_b = b.position_m + b.orientation * joint.anchor_b_m;
    largest = std::max(largest, (at_a - at_b).norm());
  }
  return largest;
}

// The scene's dolls, each thrown a little differently in each copy but the first.
std::vector<BodyState> thrown(const Scenario& scenario, int copy) {
  std::vector<BodyState> states = scenario.initial;
  constexpr std::size_t kLimbs = 10;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto doll = static_cast<double>(i / kLimbs + 1);
    states[i].linear_velocity_m_s +=
        0.1 * Vec3(std::sin(copy * doll), std::sin(2.0 * copy * doll), 0.0);
  }
  return states;
}

// What a run finds at its worst is chance: each copy tumbles otherwise.
TEST(Ragdolls, TumbleDownWithHardlyAnyGapOrOverlap) {
  constexpr int kCopies = 30;
  const Scenario scenario = read_scenario_file((library_folder() / "ragdolls.json").string());
  const Geometry geometry(scenario.scene);
  std::vector<BodyId> ids;
  for (std::uint32_t i = 0; i < scenario.initial.size(); ++i) ids.push_back(BodyId{i});
  double sum_of_deepest_m = 0.0;
  for (int copy = 0; copy < kCopies; ++copy) {
    std::vector<BodyState> states = thrown(scenario, copy);
    StepScratch scratch;
    StepReport report;
    StageCounters counters;
    double overlap_m = 0.0;
    for (std::int64_t step = 0; step < scenario.run.steps; ++step) {
      physics::step(scenario.scene, geometry, ids, states, {scratch, report, counters});
      ASSERT_TRUE(report.faults.empty()) << copy << ", step " << step;
      for (const IslandReport& island : report.islands)
        overlap_m = std::max(overlap_m, island.max_penetration_m);
      ASSERT_LE(largest_gap_m(scenario.scene, states), 1e-4) << copy << ", step " << step;
    }
    for (const BodyState& state : states) EXPECT_GT(state.position_m.z(), 0.0) << copy;
    EXPECT_LE(overlap_m, 3e-3) << copy;
    sum_of_deepest_m += overlap_m;
  }
  EXPECT_LE(sum_of_deepest_m / kCopies, 1e-3);
  RecordProperty("mean_overlap_m", std::to_string(sum_of_deepest_m / kCopies));
}

}  // namespace
}  // namespace soda::scenarios
