#include <gtest/gtest.h>

#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

// Rows of a page's tables begin with the name of a scene.
void expect_a_row_each(const std::filesystem::path& folder, const std::string& page) {
  const std::string text = file_bytes(std::filesystem::path(SODA_SOURCE_DIR) / "docs" / page);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".json") continue;
    const std::string row = "\n| `" + entry.path().stem().string() + "` |";
    EXPECT_NE(text.find(row), text.npos) << page << " has no row" << row;
  }
}

TEST(Library, ScenesAndCasesHaveARowEachInTheDocumentation) {
  expect_a_row_each(library_folder(), "scenarios.md");
  expect_a_row_each(library_folder().parent_path() / "cases", "numerical-cases.md");
}

TEST(Library, HoldsTheScenesThatOtherTestsRelyOn) {
  for (const char* name : {"big-body",
                           "billiards",
                           "bin-1000",
                           "border-stack",
                           "breaking-bridge",
                           "crowd",
                           "detection-only",
                           "eight-corner",
                           "factory-line",
                           "fast-crosser",
                           "five-worlds-chain",
                           "mill",
                           "mixed-shapes",
                           "pyramid",
                           "ragdolls",
                           "robot-arm",
                           "rope-bridge",
                           "sparse-10000",
                           "spheres-frictionless",
                           "spring-sleds",
                           "third-world",
                           "twelve-worlds",
                           "twelve-worlds-blocks",
                           "twelve-worlds-piles",
                           "user-input",
                           "wrecking-balls"}) {
    EXPECT_TRUE(std::filesystem::exists(library_folder() / (std::string(name) + ".json"))) << name;
  }
}

TEST(Library, ScenesAreReadDescribedAndDivisibleAmong48Worlds) {
  for (const auto& file : library_files()) {
    const Scenario scenario = read_scenario_file(file.string());
    EXPECT_EQ(scenario.name, file.stem());
    EXPECT_FALSE(scenario.description.empty()) << scenario.name;
    EXPECT_FALSE(scenario.initial.empty()) << scenario.name;
    EXPECT_GT(scenario.run.steps, 0) << scenario.name;
    const auto& cells = scenario.territory.grid.cells;
    EXPECT_GE(std::int64_t{cells[0]} * cells[1] * cells[2], 48) << scenario.name;
  }
}

TEST(Library, TwelveWorldsIsThePapersScene) {
  const Scenario scene = read_scenario_file((library_folder() / "twelve-worlds.json").string());
  EXPECT_EQ(scene.territory.worlds, 12u);
  EXPECT_EQ(scene.territory.map, models::MapKind::kKMeans);
  EXPECT_EQ(scene.territory.grid.cells, (std::array<std::int32_t, 3>{99, 99, 29}));
  EXPECT_EQ(scene.initial.size(), 500u);
  EXPECT_EQ(scene.run.steps, 600);
  EXPECT_EQ(scene.run.buffer, 48);
}

TEST(Library, SeedOfTheCallerReplacesThoseOfTheFile) {
  const std::string file = (library_folder() / "twelve-worlds.json").string();
  const Scenario own = read_scenario_file(file), other = read_scenario_file(file, 77);
  EXPECT_EQ(other.territory.seed, 77u);
  EXPECT_NE(own.initial[0].position_m, other.initial[0].position_m);
}

}  // namespace
}  // namespace soda::scenarios
