// Each warning where it should be, and none where nothing is wrong.
#include "scenarios/warnings.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

// A box above a floor, and a ball beside it: nothing to warn of.
constexpr std::string_view kGoodScenario = R"({
  "format": 1,
  "gravity_m_s2": [0, 0, -9.81],
  "time_step_s": 0.01,
  "steps": 100,
  "materials": [{"name": "wood", "friction": 0.5, "restitution": 0.25}],
  "bodies": [
    {"id": 1, "shape": {"type": "box", "size_m": [1, 1, 1]}, "mass_kg": 2,
     "material": "wood", "position_m": [0, 0, 0.5]},
    {"id": 2, "shape": {"type": "sphere", "radius_m": 0.5}, "mass_kg": 1,
     "material": "wood", "position_m": [3, 0, 5]}
  ],
  "statics": [
    {"name": "floor", "shape": {"type": "halfspace"}, "material": "wood"}
  ],
  "joints": [],
  "territory": {"origin_m": [-8, -8, 0], "cell_size_m": 4, "cells": [4, 4, 4], "worlds": 2}
})";

constexpr std::string_view kFloor = R"({"type": "halfspace"})";

// Open above, around body 2, with its faces outwards.
constexpr std::string_view kFunnelInsideOut =
    R"({"type": "mesh", "vertices_m": [[2,-1,4],[4,-1,4],[3,1,4],[3,0,2]],
        "triangles": [[0,3,1],[1,3,2],[2,3,0]]})";

std::vector<InputWarning> warnings_of(std::string_view text) {
  return read_scenario_text(text, "test.json").warnings;
}

// One edit of the good scenario and the one warning that it brings.
struct Slip {
  const char* name;
  std::string_view from, to;
  const char *kind, *pointer;
  const char* found;  // part of what is said
};

void PrintTo(const Slip& slip, std::ostream* out) { *out << slip.name; }

class Warning : public testing::TestWithParam<Slip> {};

TEST_P(Warning, IsGivenOnceWithPlaceAndKind) {
  const Slip& slip = GetParam();
  const auto warnings = warnings_of(replaced(kGoodScenario, slip.from, slip.to));
  ASSERT_EQ(warnings.size(), 1u) << warnings.size();
  EXPECT_EQ(warnings[0].kind, slip.kind);
  EXPECT_EQ(warnings[0].pointer, slip.pointer);
  EXPECT_NE(warnings[0].found.find(slip.found), std::string::npos) << warnings[0].found;
  EXPECT_GT(warnings[0].line, 0u);
  EXPECT_FALSE(warnings[0].likely.empty());
}

#define SODA_MESH(vertices, triangles) \
  R"({"type": "mesh", "vertices_m": )" vertices R"(, "triangles": )" triangles "}"
// A square 10 m wide at z = 0, and a tetrahedron well below.
#define SODA_SQUARE(triangles) SODA_MESH("[[-5,-5,0],[5,-5,0],[5,5,0],[-5,5,0]]", triangles)
#define SODA_SOLID(triangles) SODA_MESH("[[-5,-5,-5],[5,-5,-5],[0,5,-5],[0,0,-1]]", triangles)
#define SODA_JOINT(members) R"("joints": [{"id": 1, "body": 2, )" members "}]"

const Slip kSlips[] = {
    {"JointFarOffItsBody", "\"joints\": []",
     SODA_JOINT(R"("type": "ball", "anchor_m": [503, 0, 5])"), "anchor-far", "/joints/0/anchor_m",
     "an anchor 500 m off the centre of body 2"},
    {"SpringFarOffItsBody", "\"joints\": []",
     SODA_JOINT(R"("type": "spring", "other_body": 1, "anchor_m": [3, 0, 15],
                   "other_anchor_m": [0, 0, 0.5], "stiffness_newton_m": 5)"),
     "anchor-far", "/joints/0/anchor_m", "10 m off the centre of body 2"},
    {"BodyBelowTheFloor", "[0, 0, 0.5]", "[0, 0, -0.5]", "below-floor", "/bodies/0",
     "body 1 with its centre 0.5 m beneath static \"floor\""},
    {"BodyHalfInTheFloor", "[0, 0, 0.5]", "[0, 0, 0.2]", "overlap-static", "/bodies/0",
     "body 1 that overlaps static \"floor\" by 0.3 m"},
    {"BodyInAStaticBox", kFloor, R"({"type": "box", "size_m": [9, 9, 1]})", "overlap-static",
     "/bodies/0", "body 1 that overlaps static \"floor\" by 0.5 m"},
    {"BodyBelowAStaticBox", R"({"type": "halfspace"}, "material": "wood")",
     R"({"type": "box", "size_m": [9, 9, 1]}, "material": "wood", "position_m": [0, 0, 3])",
     "below-floor", "/bodies/0", "body 1 beneath all statics"},
    {"BodiesInEachOther", "[3, 0, 5]", "[0.5, 0, 0.5]", "overlap", "/bodies/1",
     "body 2 that overlaps body 1 by 0.5 m"},
    {"BodiesInOnePlace", "[3, 0, 5]", "[0, 0, 0.5]", "overlap", "/bodies/1",
     "body 2 with the centre of body 1"},
    {"TerritoryElsewhere", "[-8, -8, 0]", "[80, -8, 0]", "empty-territory", "/territory",
     "holds no body"},
    {"BodyFarOutside", "[3, 0, 5]", "[30, 0, 5]", "outside-territory", "/bodies/1",
     "body 2 22 m outside a territory that is 16 m long"},
    {"ManyWorlds", "\"worlds\": 2", "\"worlds\": 64", "idle-worlds", "/territory",
     "64 worlds for 2 bodies"},
    {"MeshInMillimetres", kFloor,
     R"({"type": "mesh", "vertices_m": [[-5000,-5000,0],[5000,-5000,0],[0,5000,0]],
         "triangles": [[0,1,2]]})",
     "mesh-unit", "/statics/0/shape", "10000 m long among bodies within 5.5 m"},
    {"MeshFarTooSmall", kFloor,
     R"({"type": "mesh", "unit_m": 0.001, "vertices_m": [[-5,-5,0],[4,-5,0],[0,4,0]],
         "triangles": [[0,1,2]]})",
     "mesh-unit", "/statics/0/shape", "0.009 m long among bodies of at least 1 m"},
    {"TriangleInverted", kFloor, SODA_SQUARE("[[0,1,2],[0,3,2]]"), "mesh-sides", "/statics/0/shape",
     "neighbours face opposite sides at 1 edges"},
    {"OpenMeshUpsideDown", kFloor, SODA_SQUARE("[[0,2,1],[0,3,2]]"), "mesh-sides",
     "/statics/0/shape", "with its back to body 1, which falls through"},
    {"FunnelInsideOut", kFloor, kFunnelInsideOut, "mesh-sides", "/statics/0/shape",
     "with its back to body 2, which falls through"},
    {"ClosedMeshInsideOut", kFloor, SODA_SOLID("[[0,1,2],[0,3,1],[1,3,2],[2,3,0]]"), "mesh-sides",
     "/statics/0/shape", "closed and inside out"},
    {"NoSteps", "\"steps\": 100", "\"steps\": 0", "no-steps", "/steps", "a run of 0 steps"},
    {"StepOfASecond", "\"time_step_s\": 0.01", "\"time_step_s\": 1", "long-step", "/time_step_s",
     "falls 9.81 m"},
    {"InputAfterTheEnd", "\"joints\": []",
     R"("inputs": [{"type": "remove", "id": 1, "body": 2, "step": 100}])", "late-input",
     "/inputs/0", "an input of step 100 in a run of 100"},
    {"GravityUp", "[0, 0, -9.81]", "[0, 0, 9.81]", "gravity-off-floor", "/gravity_m_s2",
     "presses onto no halfspace"},
    {"GravityAlongTheFloor", "[0, 0, -9.81]", "[0, -9.81, 0]", "gravity-off-floor", "/gravity_m_s2",
     "presses onto no halfspace"},
    {"NothingMoves", "[0, 0, -9.81]", "[0, 0, 0]", "nothing-moves", "/gravity_m_s2",
     "nothing else that moves"},
};

INSTANTIATE_TEST_SUITE_P(All, Warning, testing::ValuesIn(kSlips),
                         [](const auto& each) { return each.param.name; });

TEST(Warnings, AGoodSceneHasNone) { EXPECT_TRUE(warnings_of(kGoodScenario).empty()); }

// What looks alike and is meant.
TEST(Warnings, OddScenesThatAreRightHaveNone) {
  const std::pair<std::string_view, std::string_view> kEdits[] = {
      // A pendulum of 40 m, a dumbbell, a room, contacts at rest, a slope, and what was pressed.
      {"\"joints\": []", SODA_JOINT(R"("type": "ball", "anchor_m": [3, 0, 45])")},
      {"\"joints\": []",
       SODA_JOINT(R"("type": "fixed", "other_body": 1, "anchor_m": [1.5, 0, 2.5])")},
      {"\"joints\": []", SODA_JOINT(R"("type": "ball", "anchor_m": [3, 0, 5.5], "reach_m": 50)")},
      {"[0, 0, 0.5]", "[0, 0, 0.47]"},
      {"[3, 0, 5]", "[0.99, 0, 0.5]"},
      {"[0, 0, -9.81]", "[5, 0, -0.1]"},
      {kFloor, SODA_SQUARE("[[0,1,2],[0,2,3]]")},
      {kFloor, SODA_SQUARE("[[0,1,2]]")},
      {kFloor, SODA_SOLID("[[0,2,1],[0,1,3],[1,2,3],[2,0,3]]")},
  };
  for (const auto& [from, to] : kEdits) {
    const auto warnings = warnings_of(replaced(kGoodScenario, from, to));
    EXPECT_TRUE(warnings.empty()) << to << ": " << warnings[0].kind << ", " << warnings[0].found;
  }
}

TEST(Warnings, OfAMeshThatSomethingElseKeepsABodyFromAreNotGiven) {
  const std::string text = replaced(kGoodScenario, kFloor, kFunnelInsideOut);
  ASSERT_FALSE(warnings_of(text).empty());
  EXPECT_TRUE(warnings_of(replaced(text, "\"statics\": [",
                                   R"("statics": [{"name": "lid", "material": "wood",
                                       "shape": {"type": "box", "size_m": [4, 4, 0.2]},
                                       "position_m": [3, 0, 4.2]},)"))
                  .empty());
}

TEST(Warnings, OfAMeshThatABodyPassesThroughAnywayAreNotGiven) {
  std::string text = replaced(kGoodScenario, kFloor, kFunnelInsideOut);
  text = replaced(text, "\"joints\": []",
                  R"("ignored_collisions": [{"group": "smoke", "with": "glass"}])");
  text =
      replaced(text, "\"name\": \"floor\"", "\"name\": \"floor\", \"collision_group\": \"glass\"");
  text = replaced(text, "{\"id\": 2,", "{\"id\": 2, \"collision_group\": \"smoke\",");
  EXPECT_TRUE(warnings_of(text).empty());
}

// A box of 1 m in the middle of two on each side.
TEST(Warnings, OfWhatIsInTheMiddleOfARingAreNotGiven) {
  const auto ring = [](const char* half_m) {
    const std::string part = R"({"shape": {"type": "box", "size_m": [0.4, 0.4, 0.4]})";
    const std::string text =
        replaced(kGoodScenario, R"({"type": "sphere", "radius_m": 0.5})",
                 R"({"type": "compound", "parts": [)" + part + R"(, "position_m": [-)" + half_m +
                     ", 0, 0]}, " + part + R"(, "position_m": [)" + half_m + ", 0, 0]}]}");
    return warnings_of(replaced(text, "[3, 0, 5]", "[0, 0, 0.5]"));
  };
  EXPECT_TRUE(ring("0.8").empty());
  ASSERT_EQ(ring("0.6").size(), 1u);
  EXPECT_NE(ring("0.6")[0].found.find("body 2 that overlaps body 1 by 0.1 m"), std::string::npos)
      << ring("0.6")[0].found;
}

TEST(Warnings, OfABodyThatIsNotThereYetAreNotGiven) {
  EXPECT_TRUE(warnings_of(replaced(kGoodScenario, "\"position_m\": [3, 0, 5]",
                                   "\"position_m\": [0, 0, 0], \"present\": false"))
                  .empty());
}

TEST(Warnings, OfBodiesThatPassThroughEachOtherAreNotGiven) {
  const std::string text = replaced(kGoodScenario, "[3, 0, 5]", "[0.1, 0, 0.5]");
  EXPECT_TRUE(warnings_of(replaced(text, "\"joints\": []",
                                   "\"solver\": {\"contact_response\": "
                                   "false}"))
                  .empty());
}

TEST(Warnings, OfBodiesHeldTogetherByAJointAreNotGiven) {
  const std::string text = replaced(kGoodScenario, "[3, 0, 5]", "[0.5, 0, 0.5]");
  const std::string joint =
      SODA_JOINT(R"("type": "ball", "other_body": 1, "anchor_m": [0.25, 0, 0.5])");
  EXPECT_TRUE(warnings_of(replaced(text, "\"joints\": []", joint)).empty());
}

TEST(Warnings, OfAGeneratorNameItAndCountWhatIsNotListed) {
  const auto warnings =
      warnings_of(replaced(kGoodScenario, "\"joints\": []",
                           R"("generators": [{"type": "grid", "first_id": 10, "count": [5, 1, 1],
                   "spacing_m": [0.5, 1, 1], "shape": {"type": "box", "size_m": [1, 1, 1]},
                   "mass_kg": 1, "material": "wood", "position_m": [0, 5, 3]}])"));
  ASSERT_EQ(warnings.size(), kListedWarnings);
  for (const InputWarning& warning : warnings) {
    EXPECT_EQ(warning.kind, "overlap");
    EXPECT_EQ(warning.pointer, "/generators/0");
  }
  EXPECT_EQ(warnings[0].found, "body 11 that overlaps body 10 by 0.5 m");
  EXPECT_EQ(warnings[0].more, 0u);
  EXPECT_EQ(warnings[2].more, 1u);
  EXPECT_NE(warning_text("a.json", warnings[2]).find("/generators/0: warning overlap: found body"),
            std::string::npos);
  EXPECT_TRUE(warning_text("a.json", warnings[2]).ends_with("and 1 more of this kind"));
}

// A thousand bodies in one place would be half a million pairs.
TEST(Warnings, OfAHeapInOnePlaceAreTakenBodyByBody) {
  const auto warnings =
      warnings_of(replaced(kGoodScenario, "\"joints\": []",
                           R"("generators": [{"type": "grid", "first_id": 10, "count": [1000, 1, 1],
                   "spacing_m": [0, 1, 1], "shape": {"type": "box", "size_m": [1, 1, 1]},
                   "mass_kg": 1, "material": "wood", "position_m": [0, 5, 3]}])"));
  ASSERT_EQ(warnings.size(), kListedWarnings);
  EXPECT_EQ(warnings.back().more, 999u - kListedWarnings);
}

// A hub with many spokes fills in, a chain of as many joints does not.
TEST(Warnings, TellOfJointsThatTakeLongerThanTheStep) {
  const auto with_spokes = [](int spokes, bool chain) {
    std::string bodies, joints;
    for (int i = 0; i < spokes; ++i) {
      const std::string id = std::to_string(10 + i);
      const std::string other = chain ? std::to_string(i == 0 ? 2 : 9 + i) : "2";
      const std::string place =
          "[3, " + std::to_string(i % 20) + ", " + std::to_string(8 + i) + "]";
      bodies += R"(, {"id": )" + id +
                R"(, "shape": {"type": "sphere", "radius_m": 0.2}, "mass_kg": 1,
                       "material": "wood", "position_m": )" +
                place + "}";
      joints += (i ? "," : "") + (R"({"id": )" + id + R"(, "type": "ball", "body": )") + id +
                R"(, "other_body": )" + other + R"(, "anchor_m": )" + place + "}";
      if (!chain)  // and the world holds it
        joints += R"(, {"id": )" + std::to_string(1000 + i) + R"(, "type": "ball", "body": )" + id +
                  R"(, "anchor_m": )" + place + "}";
    }
    const std::string text =
        replaced(kGoodScenario, "\"joints\": []",
                 R"("solver": {"quality": "accurate"}, "joints": [)" + joints + "]");
    const std::size_t end = text.find("]", text.find("\"position_m\": [3, 0, 5]")) + 2;
    return text.substr(0, end) + bodies + text.substr(end);
  };
  const auto of_hub = warnings_of(with_spokes(200, false));
  const auto cost = std::ranges::find(of_hub, "joint-cost", &InputWarning::kind);
  ASSERT_NE(cost, of_hub.end());
  EXPECT_EQ(cost->pointer, "/joints");
  EXPECT_NE(cost->found.find("201 bodies"), std::string::npos) << cost->found;
  for (const InputWarning& warning : warnings_of(with_spokes(200, true)))
    EXPECT_NE(warning.kind, "joint-cost") << warning.found;
}

TEST(Warnings, OfScenesOfTheLibraryAreNone) {
  for (const auto& file : library_files())
    for (const InputWarning& warning : read_scenario_file(file.string()).warnings)
      ADD_FAILURE() << warning_text(file.filename().string(), warning);
}

// Bodies in one place are what `coincident` is about.
TEST(Warnings, OfCasesAreNoneButWhereTheyAreMeant) {
  const std::set<std::pair<std::string, std::string>> kMeant = {{"coincident", "overlap"}};
  std::set<std::pair<std::string, std::string>> found;
  for (const auto& entry :
       std::filesystem::directory_iterator(library_folder().parent_path() / "cases")) {
    if (entry.path().extension() != ".json") continue;
    for (const InputWarning& warning : read_scenario_file(entry.path().string()).warnings) {
      const bool meant = kMeant.contains({entry.path().stem().string(), warning.kind});
      EXPECT_TRUE(meant) << warning_text(entry.path().filename().string(), warning);
      found.insert({entry.path().stem().string(), warning.kind});
    }
  }
  EXPECT_EQ(found, kMeant);
}

}  // namespace
}  // namespace soda::scenarios
