// The plan of a scene: which stages, rows, kernels, buffers and messages it needs, and why.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "models/run/simulation.hpp"

namespace soda::models {

// Says what the code that does the work goes by (physics/model/need.hpp, run_stages.hpp). So a
// stage that is not needed cannot be entered, by speculation as little as by what is committed, and
// it does not matter that counters hold both.
struct PlanLine {
  std::string stage;  // e.g. "friction rows", "ghosts", "box-box kernel"
  bool needed = false;
  std::string reason;  // one clause, e.g. "no material has friction > 0"
  // The work that a run counted for the stage: 0 if it is not needed.
  std::function<std::uint64_t(const SimulationResult&)> count;
};

// What a run of this scene with these options will use.
std::vector<PlanLine> make_plan(const physics::SceneDescription& scene, std::uint32_t worlds,
                                const RunOptions& options);

// Of each line, in the same order.
std::vector<std::uint64_t> plan_counters(const std::vector<PlanLine>& plan,
                                         const SimulationResult& result);

}  // namespace soda::models
