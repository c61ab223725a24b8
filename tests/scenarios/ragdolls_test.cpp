// Dolls that tumble down stairs: how far limbs come apart and sink into things.
#include <gtest/gtest.h>

#include <algorithm>
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

TEST(Ragdolls, TumbleDownWithHardlyAnyGapOrOverlap) {
  const Scenario scenario = read_scenario_file((library_folder() / "ragdolls.json").string());
  const Geometry geometry(scenario.scene);
  std::vector<BodyState> states = scenario.initial;
  std::vector<BodyId> ids;
  for (std::uint32_t i = 0; i < states.size(); ++i) ids.push_back(BodyId{i});
  StepScratch scratch;
  StepReport report;
  StageCounters counters;
  double overlap_m = 0.0, gap_m = 0.0;
  for (std::int64_t step = 0; step < scenario.run.steps; ++step) {
    physics::step(scenario.scene, geometry, ids, states, {scratch, report, counters});
    ASSERT_TRUE(report.faults.empty()) << step;
    for (const IslandReport& island : report.islands)
      overlap_m = std::max(overlap_m, island.max_penetration_m);
    gap_m = std::max(gap_m, largest_gap_m(scenario.scene, states));
  }
  EXPECT_LE(overlap_m, 1e-3);
  EXPECT_LE(gap_m, 1e-4);
  for (const BodyState& state : states) EXPECT_GT(state.position_m.z(), 0.0);
  RecordProperty("overlap_m", std::to_string(overlap_m));
  RecordProperty("gap_m", std::to_string(gap_m));
}

}  // namespace
}  // namespace soda::scenarios
