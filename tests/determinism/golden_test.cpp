// Stored digests of the scenario library: the bits must not depend on optimisation, on the
// processor's libm variants, or on the day.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "models/simulation.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda {
namespace {

struct Golden {
  std::string scenario;
  std::int64_t steps;
  std::uint64_t digest;
};

// Lines "scenario steps digest"; made by tests/golden/update.sh.
std::vector<Golden> stored_digests() {
  std::ifstream file(SODA_SOURCE_DIR "/tests/golden/digests.txt");
  std::vector<Golden> stored;
  for (std::string line; std::getline(file, line);) {
    Golden golden;
    std::istringstream(line) >> golden.scenario >> golden.steps >> std::hex >> golden.digest;
    stored.push_back(golden);
  }
  return stored;
}

std::uint64_t final_digest(const Golden& golden) {
  const scenarios::Scenario scenario = scenarios::read_scenario_file(
      SODA_SOURCE_DIR "/scenarios/library/" + golden.scenario + ".json");
  models::TerritoryOptions one = scenario.territory;
  one.worlds = 1;
  const models::SimulationResult result =
      models::simulate(scenario.scene, scenario.initial, models::make_territory_map(one, {}),
                       {.steps = golden.steps, .inputs = scenario.run.inputs});
  return models::final_digest(result);
}

TEST(GoldenDigests, EveryLibraryScenarioGivesItsStoredDigest) {
  for (const Golden& golden : stored_digests()) {
    EXPECT_EQ(final_digest(golden), golden.digest) << golden.scenario;
  }
}

TEST(GoldenDigests, EveryLibraryScenarioHasOne) {
  std::set<std::string> stored, library;
  for (const Golden& golden : stored_digests()) stored.insert(golden.scenario);
  for (const auto& entry :
       std::filesystem::directory_iterator(SODA_SOURCE_DIR "/scenarios/library")) {
    if (entry.path().extension() == ".json") library.insert(entry.path().stem());
  }
  EXPECT_EQ(stored, library);
}

}  // namespace
}  // namespace soda
