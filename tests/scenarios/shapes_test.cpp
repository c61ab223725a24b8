#include "scenarios/shapes.hpp"

#include <gtest/gtest.h>

#include "scenarios/mesh_file.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

const physics::BodyState& state_of(const Scenario& scenario, std::uint32_t label) {
  for (std::size_t i = 0; i < scenario.scene.bodies.size(); ++i) {
    if (scenario.scene.bodies[i].label == label) return scenario.initial[i];
  }
  ADD_FAILURE() << "no body " << label;
  return scenario.initial.front();
}

TEST(Bodies, AreOrderedByIdAndKeepItAsLabel) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  std::vector<std::uint32_t> labels;
  for (const auto& body : scenario.scene.bodies) labels.push_back(body.label);
  EXPECT_EQ(labels, (std::vector<std::uint32_t>{2, 3, 7, 10, 11, 12, 20, 21, 22, 23, 24}));
  EXPECT_EQ(scenario.initial.size(), labels.size());
}

// A sphere of radius r has m = 4/3 pi r^3 rho and I = 2/5 m r^2; a box I_x = m (y^2 + z^2) / 12.
TEST(Bodies, HaveTheMassAndInertiaOfTheirShape) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  const physics::BodyParams& sphere = scenario.scene.bodies[0];
  const double mass = 500.0 * 4.0 / 3.0 * 3.14159265358979323846 * 0.125;
  EXPECT_NEAR(sphere.mass_kg, mass, 1e-12 * mass);
  EXPECT_NEAR(sphere.inertia_local_kg_m2(1, 1), 0.4 * mass * 0.25, 1e-12 * mass);
  EXPECT_NEAR(sphere.inverse_inertia_local(2, 2) * 0.4 * mass * 0.25, 1.0, 1e-12);

  const physics::BodyParams& box = scenario.scene.bodies[2];
  EXPECT_EQ(box.mass_kg, 2.0);
  EXPECT_NEAR(box.inertia_local_kg_m2(0, 0), 2.0 * (4.0 + 9.0) / 12.0, 1e-12);
  EXPECT_NEAR(box.inertia_local_kg_m2(2, 2), 2.0 * (1.0 + 4.0) / 12.0, 1e-12);
}

// The tetrahedron of the small scenario has its centre at (1/4, 1/4, 1/4) of its own frame, which
// is turned by 90 degrees about z and placed at (6, 0, 5).
TEST(Hull, IsMovedToItsCentreOfMassWithoutMovingInTheWorld) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  const physics::BodyState& state = state_of(scenario, 3);
  EXPECT_NEAR(state.position_m.x(), 5.75, 1e-12);
  EXPECT_NEAR(state.position_m.y(), 0.25, 1e-12);
  EXPECT_NEAR(state.position_m.z(), 5.25, 1e-12);
  const auto& shape = scenario.scene.shapes[scenario.scene.bodies[1].shape];
  EXPECT_LT(physics::mass_properties(shape).center_local_m.norm(), 1e-15);
  const auto& hull = std::get<physics::ConvexHull>(shape);
  bool origin_vertex = false;
  for (const Vec3& v : hull.vertices_m) {
    const Vec3 world = state.position_m + state.orientation._transformVector(v);
    origin_vertex = origin_vertex || (world - Vec3(6.0, 0.0, 5.0)).norm() < 1e-12;
  }
  EXPECT_TRUE(origin_vertex);
}

TEST(Hull, InertiaTimesItsInverseIsIdentityThoughNotDiagonal) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  const physics::BodyParams& hull = scenario.scene.bodies[1];
  EXPECT_GT(std::abs(hull.inertia_local_kg_m2(0, 1)), 1e-3);
  const physics::Mat3 product = hull.inertia_local_kg_m2 * hull.inverse_inertia_local;
  EXPECT_LT((product - physics::Mat3::Identity()).norm(), 1e-12);
}

TEST(Shapes, ThatAreEqualAreKeptOnce) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  // box, sphere (of a body and two generators), hull, halfspace, mesh
  EXPECT_EQ(scenario.scene.shapes.size(), 5u);
}

TEST(HalfSpaceShape, NormalIsMadeUnit) {
  const Scenario scenario = read_scenario_text(kSmallScenario, "a.json");
  const auto& shape = scenario.scene.shapes[scenario.scene.statics[0].shape];
  EXPECT_EQ(std::get<physics::HalfSpace>(shape).normal, Vec3(0.0, 0.0, 1.0));
}

TEST(MeshFile, ObjKeepsTheOrderOfItsTriangles) {
  const auto read = read_mesh_file((library_folder() / "terrain.obj").string(), 2.0);
  ASSERT_TRUE(std::holds_alternative<physics::TriangleMesh>(read)) << std::get<1>(read);
  const auto& mesh = std::get<physics::TriangleMesh>(read);
  EXPECT_EQ(mesh.vertices_m.size(), 169u);
  ASSERT_EQ(mesh.triangles.size(), 288u);
  // "f 1 2 15" of the file; vertex 1 is (-6, -6, ...), in units of 2 m.
  EXPECT_EQ(mesh.vertices_m[mesh.triangles[0][0]].x(), -12.0);
  EXPECT_EQ(mesh.vertices_m[mesh.triangles[0][1]].x(), -10.0);
  EXPECT_EQ(mesh.vertices_m[mesh.triangles[0][2]].y(), -10.0);
}

TEST(MeshFile, BinaryStlIsWeldedAndScaled) {
  const auto read = read_mesh_file((library_folder() / "ramp.stl").string(), 0.001);
  ASSERT_TRUE(std::holds_alternative<physics::TriangleMesh>(read)) << std::get<1>(read);
  const auto& mesh = std::get<physics::TriangleMesh>(read);
  EXPECT_EQ(mesh.vertices_m.size(), 6u);
  EXPECT_EQ(mesh.triangles.size(), 8u);
  double highest = 0.0;
  for (const Vec3& v : mesh.vertices_m) highest = std::max(highest, v.z());
  EXPECT_EQ(highest, 2.0);
}

}  // namespace
}  // namespace soda::scenarios
