// The same scene in other units is the same run: no length, time or mass is built in. Units that
// are powers of two round nothing, so every bit is the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "models/run/simulation.hpp"
#include "scenarios/read_scenario.hpp"
#include "tests/determinism/golden_runs.hpp"
#include "tests/support/other_units.hpp"

namespace soda::test {
namespace {

using physics::BodyState;

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Three numbers have a default with a unit, which a scene need not have.
void give_defaults(const scenarios::Scenario& from, const Units& units, scenarios::Scenario& to) {
  to.scene.solver.restitution_threshold_m_s =
      from.scene.solver.restitution_threshold_m_s * (units.length / units.time);
  to.scene.solver.push_out_1_s = from.scene.solver.push_out_1_s / units.time;
  for (std::size_t j = 0; j < from.scene.joints.size(); ++j)
    if (from.scene.joints[j].motor)
      to.scene.joints[j].motor->time_constant_s =
          from.scene.joints[j].motor->time_constant_s * units.time;
}

// In sequence and undivided; the states after every step.
std::vector<std::vector<BodyState>> run(const scenarios::Scenario& scenario, std::int64_t steps) {
  models::TerritoryOptions one = scenario.territory;
  one.worlds = 1;
  std::vector<std::vector<BodyState>> all;
  models::CommitObserver observer;
  observer.wants_states = true;
  observer.on_step = [&](const models::CommittedStep& step) {
    std::vector<BodyState>& states = all.emplace_back();
    for (const BodyState& state : step.states) states.push_back(motion_of(state));
  };
  const models::SimulationResult result =
      models::simulate(scenario.scene, scenario.initial, models::make_territory_map(one, {}),
                       {.steps = steps, .inputs = scenario.run.inputs}, observer);
  EXPECT_EQ(result.committed_steps, steps);
  return all;
}

// In the first units.
BodyState taken_back(const Units& units, BodyState state) {
  state.position_m /= units.length;
  state.linear_velocity_m_s *= units.time / units.length;
  state.angular_velocity_rad_s *= units.time;
  return state;
}

class OtherUnits : public testing::TestWithParam<GoldenRun> {};

void expect_same(const std::string& scene, const Units& units) {
  constexpr std::int64_t kBodySteps = 8000, kMost = 200;  // a second or few
  const std::string file = scene_file(scene), text = text_of(file);
  const scenarios::Scenario first = scenarios::read_scenario_text(text, file);
  scenarios::Scenario other = scenarios::read_scenario_text(in_other_units(text, units), file);
  give_defaults(first, units, other);
  const auto bodies = static_cast<std::int64_t>(first.initial.size());
  const std::int64_t steps =
      std::min({first.run.steps, kMost, std::max(std::int64_t{4}, kBodySteps / (1 + bodies))});
  const auto runs = run(first, steps), others = run(other, steps);
  ASSERT_EQ(runs.size(), others.size());
  for (std::size_t step = 0; step < runs.size(); ++step) {
    ASSERT_EQ(runs[step].size(), others[step].size());
    for (std::size_t b = 0; b < runs[step].size(); ++b) {
      const physics::FieldDifference difference =
          first_difference(runs[step][b], taken_back(units, others[step][b]));
      ASSERT_STREQ(difference.field, "")
          << difference.field << " step " << step + 1 << ", body " << b << std::hexfloat << ": "
          << difference.a << ", " << difference.b;
    }
  }
}

TEST_P(OtherUnits, OfMassGiveTheSameMotion) {
  expect_same(GetParam().scene, {.mass = std::ldexp(1.0, -4)});
}

TEST_P(OtherUnits, OfTimeGiveTheSameMotion) {
  expect_same(GetParam().scene, {.time = std::ldexp(1.0, -2)});
}

TEST_P(OtherUnits, OfLengthGiveTheSameMotion) {
  expect_same(GetParam().scene, {.mass = std::ldexp(1.0, -2), .length = 0.5, .time = 2.0});
}

INSTANTIATE_TEST_SUITE_P(Scenes, OtherUnits, testing::ValuesIn(stored_runs()),
                         [](const auto& info) { return test_name(info.param); });

}  // namespace
}  // namespace soda::test
