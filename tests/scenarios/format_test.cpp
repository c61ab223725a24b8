#include "scenarios/format.hpp"

#include <gtest/gtest.h>

#include "scenarios/reference.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

// Writes what should stand in the source tree into the build folder and says how to take it over.
void expect_committed(const std::string& generated, const std::filesystem::path& committed,
                      const std::string& name) {
  if (file_bytes(committed) == generated) return;
  const auto copy = std::filesystem::path(SODA_BINARY_DIR) / name;
  std::ofstream(copy, std::ios::binary) << generated;
  ADD_FAILURE() << committed << " is out of date; what belongs there is in " << copy;
}

TEST(Schema, CommittedOneIsThatOfTheReader) {
  expect_committed(scenario_schema(),
                   std::filesystem::path(SODA_SOURCE_DIR) / "scenarios/scenario.schema.json",
                   "scenario.schema.json");
}

TEST(Reference, CommittedPageIsThatOfTheReader) {
  expect_committed(scenario_reference_markdown(),
                   std::filesystem::path(SODA_SOURCE_DIR) / "docs/scenario-format.md",
                   "scenario-format.md");
}

TEST(FormatTables, GiveEveryFieldAMeaningAndEveryLengthAUnit) {
  for (const TaggedTable& entry : all_tables()) {
    for (const Field& field : entry.table->fields) {
      EXPECT_FALSE(field.doc.empty()) << field.key;
      EXPECT_FALSE(allowed_text(field).empty()) << field.key;
      EXPECT_EQ(field.kind == ValueKind::kName, !field.names.empty()) << field.key;
      EXPECT_LE(field.limits.min, field.limits.max) << field.key;
    }
  }
  EXPECT_EQ(unit_of("density_kg_m3"), "kg/m^3");
  EXPECT_EQ(unit_of("gravity_m_s2"), "m/s^2");
  EXPECT_EQ(unit_of("max_spin_rad_s"), "rad/s");
  EXPECT_EQ(unit_of("stiffness_newton_m"), "N/m");
  EXPECT_EQ(unit_of("damping_newton_s_m"), "N s/m");
  EXPECT_EQ(unit_of("principal_inertia_kg_m2"), "kg m^2");
  EXPECT_EQ(unit_of("min_angle_rad"), "rad");
  EXPECT_EQ(unit_of("steps"), "");
}

TEST(Defaults, AreThoseOfTheLayersBelow) {
  const Scenario scenario = read_scenario_text(
      R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.5, "steps": 3})", "a.json");
  const physics::SolverSettings settings;
  EXPECT_EQ(scenario.scene.solver.iterations, settings.iterations);
  EXPECT_EQ(scenario.scene.solver.restitution_threshold_m_s, settings.restitution_threshold_m_s);
  EXPECT_EQ(scenario.scene.solver.contact_response, settings.contact_response);
  EXPECT_EQ(scenario.scene.solver.warm_starting, settings.warm_starting);
  EXPECT_EQ(scenario.scene.broadphase, physics::Broadphase::kGrid);
  EXPECT_EQ(scenario.run.buffer, models::RunOptions{}.buffer);
  EXPECT_EQ(scenario.run.balancing.policy, models::BalancingPolicy::kOff);
  EXPECT_EQ(scenario.territory.worlds, 1u);
  EXPECT_EQ(scenario.run.steps, 3);
}

TEST(Values, OfTheFileReachTheScenarioUnchanged) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  EXPECT_EQ(scenario.run.steps, 100);
  EXPECT_EQ(scenario.run.buffer, 16);
  EXPECT_EQ(scenario.run.executor, models::ExecutorKind::kThreads);
  EXPECT_EQ(scenario.run.threads, 2u);
  EXPECT_EQ(scenario.run.balancing.policy, models::BalancingPolicy::kPaper);
  EXPECT_EQ(scenario.run.balancing.interval, 20);
  EXPECT_EQ(scenario.output.log_file, "small.sodalog");
  EXPECT_TRUE(scenario.output.step_digests);
  EXPECT_EQ(scenario.scene.gravity_m_s2, physics::Vec3(0.0, 0.0, -9.81));
  EXPECT_EQ(scenario.scene.dt_s, 0.01);
  EXPECT_EQ(scenario.scene.solver.iterations, 10);
  EXPECT_EQ(scenario.scene.bodies[0].material.restitution, 0.25);
  EXPECT_EQ(scenario.initial[0].linear_velocity_m_s, physics::Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(scenario.territory.grid.cell_size_m, 2.0);
  EXPECT_EQ(scenario.territory.worlds, 2u);
  ASSERT_EQ(scenario.scene.statics.size(), 2u);
  EXPECT_EQ(scenario.scene.statics[1].name, "ramp");
  EXPECT_EQ(scenario.scene.statics[1].position_m, physics::Vec3(0.0, 9.0, 0.0));
}

TEST(Values, SurfaceVelocitiesTurnWithTheirStatic) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  ASSERT_EQ(scenario.scene.statics.size(), 2u);
  EXPECT_EQ(scenario.scene.statics[0].surface_velocity_m_s, physics::Vec3::Zero());
  const physics::Vec3 up(0.0, 0.0, 4.0);  // 4 along y, turned by 90 degrees about x
  EXPECT_LT((scenario.scene.statics[1].surface_velocity_m_s - up).norm(), 1e-15);
}

TEST(Values, DrivesReachTheBodiesThatNameThem) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  ASSERT_EQ(scenario.scene.drives.size(), 2u);
  EXPECT_EQ(scenario.scene.drives[0].velocity_m_s, physics::Vec3(0.0, 3.0, 0.0));
  EXPECT_EQ(scenario.scene.drives[0].time_constant_s, 0.5);
  EXPECT_EQ(scenario.scene.drives[0].max_acceleration_m_s2, 5.0);
  EXPECT_FALSE(scenario.scene.drives[0].lane.has_value());
  ASSERT_TRUE(scenario.scene.drives[1].lane.has_value());
  const physics::Lane& lane = *scenario.scene.drives[1].lane;
  ASSERT_EQ(lane.way_points_m.size(), 3u);
  EXPECT_EQ(lane.way_points_m[2], physics::Vec3(8.0, 8.0, 0.0));
  EXPECT_EQ(lane.half_width_m, 1.25);
  EXPECT_EQ(lane.speed_m_s, 1.5);
  for (const physics::BodyParams& body : scenario.scene.bodies) {
    EXPECT_EQ(body.drive, body.label == 3 ? 0u : physics::kNoDrive) << body.label;
  }
}

TEST(Values, EveryBodyOfAGeneratorHasItsDrive) {
  const std::string text = replaced(kSmallScenario, "\"count\": 5, \"seed\": 1,",
                                    "\"count\": 5, \"seed\": 1, \"drive\": \"lane\",");
  int driven = 0;
  for (const physics::BodyParams& body : read_scenario_text(text, "a.json").scene.bodies) {
    driven += body.drive == 1u;
  }
  EXPECT_EQ(driven, 5);
}

}  // namespace
}  // namespace soda::scenarios
