// Comparing the states of a run with what its scenario says is known of it.
#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "physics/model/body_state.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// One measure of error; what it is stands in docs/scenario-format.md, under its name.
struct Measured {
  std::string measure;
  double value = 0.0;
};

// The larger error. What is no number is the worst of all, and stays.
inline double worse(double so_far, double now) {
  return now <= so_far || std::isnan(so_far) ? so_far : now;
}

// Watches a run from its start to its end. A function of the states alone, so that every engine is
// judged alike; contact forces are judged where states carry them.
class Judge {
 public:
  virtual ~Judge() = default;
  // After every step; first of all at time 0.
  virtual void see(double time_s, std::span<const physics::BodyState> states) = 0;
  // After the last step.
  virtual std::vector<Measured> errors() const = 0;
};

// For one reference of the scenario, run in steps of dt_s for `duration_s`. The scenario must
// outlive the judge.
std::unique_ptr<Judge> make_judge(const scenarios::Scenario& scenario,
                                  const scenarios::Reference& reference, double dt_s,
                                  double duration_s);

// Whether the reference wants the run to go on backwards in time after its end.
bool wants_reversal(const scenarios::Reference& reference);

}  // namespace soda::analysis
