// A scenario: everything a JSON scenario file says, checked and expanded.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "models/options/run_options.hpp"
#include "models/territory/territory.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"
#include "scenarios/known_answer.hpp"
#include "scenarios/warning.hpp"

namespace soda::scenarios {

// An aggregate that is taken apart where a run is built; no function below takes a whole one.
// What a run writes beside its report; command-line options come first.
struct OutputOptions {
  std::string log_file;  // below the folder of the scenario; empty: none
  bool step_digests = false;
};

// What of a scenario is looked for: warnings, and where its bodies begin. Without that, bodies of
// generators may have any state, where nothing in the scenario depends on it: for who goes on from
// states of its own.
enum class ScenarioExtent { kAll, kNoWarnings, kNoStates };

struct Scenario {
  std::string name;         // of the file, without folder and ending, unless the file gives one
  std::string description;  // one paragraph, may be empty
  physics::SceneDescription scene;
  std::vector<physics::BodyState> initial;  // index == BodyId
  // As the file has them, where `initial` is of a later step; else empty.
  std::vector<physics::BodyState> declared;
  models::TerritoryOptions territory;
  models::RunOptions run;  // steps, buffer and executor defaults
  OutputOptions output;
  // By id of each joint with a motor: 1 if what the file says of it is b's against a, else -1.
  std::map<std::uint32_t, double> motor_signs;
  std::vector<Reference> references;   // what is known of the run beforehand
  std::vector<InputWarning> warnings;  // what the file hardly means, by place

  // Where a body is added of which the input says nothing else.
  const physics::BodyState& declared_state(std::size_t body) const {
    return declared.empty() ? initial[body] : declared[body];
  }
};

}  // namespace soda::scenarios
