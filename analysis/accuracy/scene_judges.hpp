// Judges of whole scenes: rest, invariants, depths, and what must not get through.
#pragma once

#include "analysis/accuracy/judge.hpp"
#include "physics/step/step.hpp"

namespace soda::analysis {

// Overlaps of bodies in given states, found by our own geometry whatever engine made the states.
class Overlaps {
 public:
  explicit Overlaps(const scenarios::Scenario& scenario);
  // The depth of every contact point that overlaps, m, appended.
  void find(std::span<const physics::BodyState> states, std::vector<double>& depths_m);

 private:
  const physics::SceneDescription& scene_;
  const physics::Geometry geometry_;
  const std::vector<physics::BodyId> ids_;
  physics::StepScratch scratch_;
  physics::StageCounters counters_;
};

std::unique_ptr<Judge> judge_rest(const scenarios::Scenario& scenario);
std::unique_ptr<Judge> judge_conserved(const scenarios::Scenario& scenario);
std::unique_ptr<Judge> judge_side(const scenarios::Scenario& scenario,
                                  const scenarios::OneSide& answer);
// `at_end`: penetration_m is that of the last state.
std::unique_ptr<Judge> judge_pile(const scenarios::Scenario& scenario, bool at_end);
std::unique_ptr<Judge> judge_stack_forces(const scenarios::Scenario& scenario, double dt_s,
                                          double duration_s);
std::unique_ptr<Judge> judge_gas(const scenarios::Scenario& scenario,
                                 const scenarios::HardSphereGas& answer, double dt_s);
// The last state against stored ends, or against the initial states.
std::unique_ptr<Judge> judge_end(const scenarios::Scenario& scenario,
                                 const std::vector<scenarios::StoredRun::End>& ends);
std::unique_ptr<Judge> judge_return(const scenarios::Scenario& scenario);

}  // namespace soda::analysis
