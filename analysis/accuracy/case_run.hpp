// One scenario with references, run by one engine at one setting: errors and cost.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/engine.hpp"
#include "analysis/accuracy/judge.hpp"
#include "physics/measures/contact_quality.hpp"

namespace soda::analysis {

// A measure beside the bounds that its reference sets.
struct JudgedMeasure {
  std::string form;  // the reference, by the name of its closed form
  std::string measure;
  double value = 0.0;
  std::optional<double> must, stretch;

  // What is no number has reached nothing.
  bool missed() const { return must && !(value <= *must); }
};

struct CaseRun {
  std::string scene, engine;
  EngineSetting setting;
  std::int64_t steps = 0;
  std::vector<JudgedMeasure> measures;
  double cpu_per_simulated_s = 0.0;  // median over repeats
  double step_ms = 0.0;              // the same, per step
  std::string fault;                 // why the run cannot be used; empty if it can
  bool given_up = false;             // beyond the budget: there are no measures
  // Over all steps; only where states carry impulses (soda), and of pairs that do not bounce.
  physics::ContactQuality contacts;
  std::optional<ErrorEstimates> estimates;  // in accuracy mode, of the judged run
};

struct RepeatRule {
  int repeats = 3;             // timed runs, of which the median counts; 0: no timing
  double long_enough_s = 5.0;  // a run that takes longer is timed once
  double budget_s = 1e9;       // a run that takes more CPU time is given up
};

// Runs the scenario's duration, rounded to whole steps of setting.dt_s, once for the errors and
// then for the cost. Cost is CPU time of the calling thread over step() alone.
CaseRun run_case(const scenarios::Scenario& scenario, const EngineKind& engine,
                 const EngineSetting& setting, const RepeatRule& rule);

}  // namespace soda::analysis
