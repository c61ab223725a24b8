// Compounds and displaced centres of mass as scenarios give them.
#include <gtest/gtest.h>

#include "physics/shapes/mass_properties.hpp"
#include "scenarios/read_scenario.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

using physics::Vec3;

std::string text_of(const std::string& bodies, const std::string& more = "") {
  return R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 1,
    "materials": [{"name": "wood", "friction": 0.5, "restitution": 0.25}],
    "bodies": [)" +
         bodies + "]" + more + "}";
}

std::string body(const std::string& shape, const std::string& more = "") {
  return R"({"id": 1, "mass_kg": 3, "material": "wood", "position_m": [10, 0, 0], "shape": )" +
         shape + more + "}";
}

// A box of 2 x 1 x 1 and, on its end, one of 1 x 1 x 1: an L of volume 3.
constexpr const char* kL = R"({"type": "compound", "parts": [
    {"shape": {"type": "box", "size_m": [2, 1, 1]}, "position_m": [1, 0, 0]},
    {"shape": {"type": "box", "size_m": [1, 1, 1]}, "position_m": [0.5, 1, 0],
     "orientation": {"axis": [0, 0, 1], "angle_deg": 90}}]})";

const physics::Compound& compound_of(const Scenario& scenario, std::size_t body) {
  return std::get<physics::Compound>(scenario.scene.shapes[scenario.scene.bodies[body].shape]);
}

TEST(CompoundShape, IsMovedToItsCentreOfMassWithoutMovingInTheWorld) {
  const Scenario scenario = read_scenario_text(
      text_of(body(kL, R"(, "orientation": {"axis": [0, 0, 1], "angle_deg": 90})")), "a.json");
  // (2 (1, 0) + (.5, 1)) / 3, turned by 90 degrees.
  const Vec3 centre(2.5 / 3, 1.0 / 3, 0);
  EXPECT_LT((scenario.initial[0].position_m - Vec3(10 - centre.y(), centre.x(), 0)).norm(), 1e-14);
  const physics::Compound& shape = compound_of(scenario, 0);
  ASSERT_EQ(shape.parts.size(), 2u);
  EXPECT_LT((shape.parts[1].position_m - (Vec3(0.5, 1, 0) - centre)).norm(), 1e-14);
  const auto mass = physics::mass_properties(shape, scenario.scene.shapes);
  EXPECT_LT(mass.center_local_m.norm(), 1e-15);
  // About z: 2 (4 + 1) / 12 + (1 + 1) / 12 + both boxes' ways from the centre squared.
  const double about_z = 10.0 / 12 + 2.0 / 12 + 2 * (Vec3(1, 0, 0) - centre).squaredNorm() +
                         (Vec3(0.5, 1, 0) - centre).squaredNorm();
  EXPECT_NEAR(scenario.scene.bodies[0].inertia_local_kg_m2(2, 2), about_z, 1e-13);
  const physics::BodyParams& params = scenario.scene.bodies[0];
  EXPECT_LT((params.inertia_local_kg_m2 * params.inverse_inertia_local - physics::Mat3::Identity())
                .norm(),
            1e-12);
}

TEST(CompoundShape, EqualOnesAreKeptOnceAndGeneratorsMakeThem) {
  const std::string stack = std::string(R"(, "generators": [{"type": "stack", "first_id": 5,
    "mass_kg": 1, "material": "wood", "count": 3, "position_m": [0, 0, 1], "shape": )") +
                            kL + "}]";
  const Scenario scenario = read_scenario_text(text_of(body(kL), stack), "a.json");
  EXPECT_EQ(scenario.scene.shapes.size(), 3u);  // two boxes and the compound
  ASSERT_EQ(scenario.initial.size(), 4u);
  EXPECT_NEAR(scenario.initial[3].position_m.z() - scenario.initial[2].position_m.z(), 1.0, 1e-14);
}

TEST(CompoundShape, MayBeAStatics) {
  const std::string statics = std::string(R"(, "statics": [{"name": "step", "material": "wood",
    "position_m": [0, 0, 1], "shape": )") +
                              kL + "}]";
  const Scenario scenario = read_scenario_text(text_of("", statics), "a.json");
  EXPECT_LT((scenario.scene.statics[0].position_m - Vec3(2.5 / 3, 1.0 / 3, 1)).norm(), 1e-14);
}

TEST(CompoundShape, FaultsNameThePart) {
  const auto message_of = [](const std::string& shape) -> std::string {
    try {
      read_scenario_text(text_of(body(shape)), "a.json");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message_of(R"({"type": "compound", "parts": []})").find("/bodies/0/shape/parts"),
            std::string::npos);
  const std::string nested = message_of(
      R"({"type": "compound", "parts": [{"shape": {"type": "compound", "parts": []}}]})");
  EXPECT_NE(nested.find("/bodies/0/shape/parts/0/shape/type"), std::string::npos) << nested;
  EXPECT_NE(nested.find("no part of a compound"), std::string::npos) << nested;
  const std::string flat = message_of(R"({"type": "compound", "parts": [{"shape":
      {"type": "hull", "points_m": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}}]})");
  EXPECT_NE(flat.find("/bodies/0/shape/parts/0/shape/points_m"), std::string::npos) << flat;
  const std::string multi = message_of(R"({"type": "multishape", "parts": []})");
  EXPECT_NE(multi.find("compound"), std::string::npos) << multi;
}

TEST(CentreOfMass, IsWhereTheFileSaysAndInertiaIsAboutIt) {
  const char* ball = R"({"type": "sphere", "radius_m": 0.5})";
  const Scenario scenario =
      read_scenario_text(text_of(body(ball, R"(, "center_of_mass_m": [0, 0, -0.2])")), "a.json");
  EXPECT_EQ(scenario.initial[0].position_m, Vec3(10, 0, -0.2));
  const physics::Compound& shape = compound_of(scenario, 0);
  ASSERT_EQ(shape.parts.size(), 1u);
  EXPECT_EQ(shape.parts[0].position_m, Vec3(0, 0, 0.2));
  const physics::Mat3& inertia = scenario.scene.bodies[0].inertia_local_kg_m2;
  EXPECT_NEAR(inertia(2, 2), 0.4 * 3 * 0.25, 1e-14);
  EXPECT_NEAR(inertia(0, 0), 0.4 * 3 * 0.25 + 3 * 0.04, 1e-14);
}

TEST(CentreOfMass, OfHullsAndCompoundsMovesThemToo) {
  const Scenario scenario = read_scenario_text(
      text_of(body(kL, R"(, "center_of_mass_m": [1, 0, 0], "principal_inertia_kg_m2": [1, 2, 3])")),
      "a.json");
  EXPECT_EQ(scenario.initial[0].position_m, Vec3(11, 0, 0));
  EXPECT_LT(compound_of(scenario, 0).parts[0].position_m.norm(), 1e-15);
  EXPECT_EQ(scenario.scene.bodies[0].inertia_local_kg_m2(1, 1), 2.0);
  const Scenario hull = read_scenario_text(
      text_of(body(R"({"type": "hull", "points_m": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]]})",
                   R"(, "center_of_mass_m": [0.1, 0.1, 0.1])")),
      "a.json");
  EXPECT_LT((hull.initial[0].position_m - Vec3(10.1, 0.1, 0.1)).norm(), 1e-15);
  EXPECT_LT((compound_of(hull, 0).parts[0].position_m - Vec3::Constant(0.15)).norm(), 1e-14);
}

TEST(CentreOfMass, ThatIsTheShapesOwnChangesNothing) {
  const char* box = R"({"type": "box", "size_m": [1, 2, 3]})";
  const Scenario plain = read_scenario_text(text_of(body(box)), "a.json"),
                 same = read_scenario_text(text_of(body(box, R"(, "center_of_mass_m": [0, 0, 0])")),
                                           "a.json");
  EXPECT_EQ(same.scene.shapes.size(), plain.scene.shapes.size());
  EXPECT_EQ(same.scene.bodies[0].inertia_local_kg_m2, plain.scene.bodies[0].inertia_local_kg_m2);
}

TEST(CentreOfMass, OutsideOfTheShapeIsAFault) {
  try {
    read_scenario_text(text_of(body(R"({"type": "sphere", "radius_m": 0.5})",
                                    R"(, "center_of_mass_m": [0, 0, -0.6])")),
                       "a.json");
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("/bodies/0/center_of_mass_m"), std::string::npos) << text;
    EXPECT_NE(text.find("z from -0.5 to 0.5"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace soda::scenarios
