#include "tests/determinism/golden_runs.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iomanip>
#include <sstream>

#include "kernel/api/hash_mix.hpp"
#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::test {

std::vector<std::string> golden_scenes() {
  std::vector<std::string> scenes;
  for (const char* folder : {"library", "cases"})
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(SODA_SOURCE_DIR "/scenarios/") + folder))
      if (entry.path().extension() == ".json")
        scenes.push_back(std::string(folder) + "/" + entry.path().stem().string());
  std::sort(scenes.begin(), scenes.end());
  return scenes;
}

std::string scene_file(const std::string& scene) {
  return SODA_SOURCE_DIR "/scenarios/" + scene + ".json";
}

namespace {

// In sequence and undivided; `digest` is made of the digests after every step.
models::SimulationResult run_plainly(const scenarios::Scenario& scenario, std::int64_t steps,
                                     const std::function<void(std::uint64_t)>& on_digest) {
  models::TerritoryOptions one = scenario.territory;
  one.worlds = 1;
  models::CommitObserver observer;
  observer.wants_states = true;
  observer.on_step = [&](const models::CommittedStep& step) {
    on_digest(physics::digest(step.ids, step.states));
  };
  return models::simulate(scenario.scene, scenario.initial, models::make_territory_map(one, {}),
                          {.steps = steps, .inputs = scenario.run.inputs}, observer);
}

// By the number of bodies, not by time: the same on every machine.
std::int64_t first_steps_of(const scenarios::Scenario& scenario) {
  constexpr std::int64_t kBodySteps = 1000, kLeast = 12;
  const auto bodies = static_cast<std::int64_t>(scenario.initial.size());
  return std::min(scenario.run.steps, std::max(kLeast, kBodySteps / (1 + bodies)));
}

}  // namespace

GoldenRun golden_run(const std::string& scene) {
  const scenarios::Scenario scenario = scenarios::read_scenario_file(scene_file(scene));
  GoldenRun run{
      .scene = scene, .steps = scenario.run.steps, .first_steps = first_steps_of(scenario)};
  std::int64_t step = 0;
  const models::SimulationResult result =
      run_plainly(scenario, run.steps, [&](std::uint64_t digest) {
        run.steps_digest = kernel::append(run.steps_digest, digest);
        if (++step == run.first_steps) run.first_digest = run.steps_digest;
      });
  run.last = models::final_digest(result);
  return run;
}

std::uint64_t digest_of_first_steps(const std::string& scene, std::int64_t steps) {
  std::uint64_t all = 0;
  run_plainly(scenarios::read_scenario_file(scene_file(scene)), steps,
              [&](std::uint64_t digest) { all = kernel::append(all, digest); });
  return all;
}

std::vector<GoldenRun> stored_runs() {
  std::ifstream file(SODA_SOURCE_DIR "/tests/golden/digests.txt");
  std::vector<GoldenRun> stored;
  for (std::string line; std::getline(file, line);) {
    GoldenRun run;
    std::istringstream(line) >> run.scene >> run.steps >> std::hex >> run.last >>
        run.steps_digest >> std::dec >> run.first_steps >> std::hex >> run.first_digest;
    stored.push_back(run);
  }
  return stored;
}

std::string to_line(const GoldenRun& run) {
  std::ostringstream line;
  const auto add = [&line](std::uint64_t digest) {
    line << " " << std::hex << std::setw(16) << std::setfill('0') << digest << std::dec;
  };
  line << run.scene << " " << run.steps;
  add(run.last);
  add(run.steps_digest);
  line << " " << run.first_steps;
  add(run.first_digest);
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
