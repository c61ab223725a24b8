#include "tests/determinism/golden_runs.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "kernel/hash_mix.hpp"
#include "models/simulation.hpp"
#include "physics/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::test {

std::vector<std::string> golden_scenes() {
  std::vector<std::string> scenes;
  for (const char* folder : {"library", "cases"})
    for (const auto& entry : std::filesystem::directory_iterator(
             std::string(SODA_SOURCE_DIR "/scenarios/") + folder))
      if (entry.path().extension() == ".json")
        scenes.push_back(std::string(folder) + "/" + entry.path().stem().string());
  std::sort(scenes.begin(), scenes.end());
  return scenes;
}

std::string scene_file(const std::string& scene) {
  return SODA_SOURCE_DIR "/scenarios/" + scene + ".json";
}

GoldenRun golden_run(const std::string& scene) {
  const scenarios::Scenario scenario = scenarios::read_scenario_file(scene_file(scene));
  models::TerritoryOptions one = scenario.territory;
  one.worlds = 1;
  GoldenRun run{.scene = scene, .steps = scenario.run.steps};
  models::CommitObserver observer;
  observer.wants_states = true;
  observer.on_step = [&run](const models::CommittedStep& step) {
    run.steps_digest = kernel::append(run.steps_digest, physics::digest(step.ids, step.states));
  };
  const models::SimulationResult result =
      models::simulate(scenario.scene, scenario.initial, models::make_territory_map(one, {}),
                       {.steps = run.steps, .inputs = scenario.run.inputs}, observer);
  run.last = models::final_digest(result);
  return run;
}

std::vector<GoldenRun> stored_runs() {
  std::ifstream file(SODA_SOURCE_DIR "/tests/golden/digests.txt");
  std::vector<GoldenRun> stored;
  for (std::string line; std::getline(file, line);) {
    GoldenRun run;
    std::istringstream(line) >> run.scene >> run.steps >> std::hex >> run.last >> run.steps_digest;
    stored.push_back(run);
  }
  return stored;
}

std::string to_line(const GoldenRun& run) {
  std::ostringstream line;
  line << run.scene << " " << run.steps << std::hex;
  for (const std::uint64_t digest : {run.last, run.steps_digest}) {
    line << " ";
    line.width(16);
    line.fill('0');
    line << digest;
  }
  return line.str();
}

std::ostream& operator<<(std::ostream& out, const GoldenRun& run) { return out << to_line(run); }

std::string test_name(const GoldenRun& run) {
  std::string name = run.scene;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '/' || c == '-'; }, '_');
  return name;
}

}  // namespace soda::test
