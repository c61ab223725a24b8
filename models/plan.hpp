// The plan of a scene: which stages, rows, kernels, buffers and messages it needs, and why.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/simulation.hpp"

namespace soda::models {

struct PlanLine {
  std::string stage;  // e.g. "friction rows", "ghosts", "box-box kernel"
  bool needed = false;
  std::string reason;  // one clause, e.g. "no material has friction > 0"
};

// What a run of this scene with these options will use.
std::vector<PlanLine> make_plan(const physics::SceneDescription& scene, std::uint32_t worlds,
                                const RunOptions& options);

// One counter per plan line, in the same order: the work that the run counted for that stage.
// A line that is not needed must be at 0.
std::vector<std::uint64_t> plan_counters(const std::vector<PlanLine>& plan,
                                         const SimulationResult& result);

}  // namespace soda::models
