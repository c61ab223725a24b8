#include "analysis/accuracy/case_run.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/measures/error_measures.hpp"
#include "analysis/text/stopwatch.hpp"
#include "physics/step/step.hpp"

namespace soda::analysis {
namespace {

using scenarios::Scenario;

std::int64_t steps_at(const Scenario& scenario, double dt_s) {
  const double duration = static_cast<double>(scenario.run.steps) * scenario.scene.dt_s;
  return std::max<std::int64_t>(1, std::llround(duration / dt_s));
}

bool reverses(const Scenario& scenario) {
  return std::any_of(scenario.references.begin(), scenario.references.end(), wants_reversal);
}

using Judges = std::vector<std::unique_ptr<Judge>>;

Judges judges_of(const Scenario& scenario, double dt_s, std::int64_t steps) {
  Judges judges;
  for (const scenarios::Reference& reference : scenario.references)
    judges.push_back(make_judge(scenario, reference, dt_s, dt_s * static_cast<double>(steps)));
  return judges;
}

// Finds the contacts of each step again, as the step found them, and measures how it left them.
class ContactWatch {
 public:
  ContactWatch(const Scenario& scenario, double dt_s)
      : scene_(with_step(scenario.scene, dt_s)),
        geometry_(scene_),
        ids_(all_ids(scenario.initial.size())) {}

  void see(std::span<const physics::BodyState> before, std::span<const physics::BodyState> after) {
    const bool known = std::any_of(after.begin(), after.end(), [](const physics::BodyState& state) {
      return !state.impulses.empty();
    });
    if (!known) return;
    physics::compute_boxes(scene_, geometry_, ids_, before, scratch_.boxes, counters_);
    physics::find_contacts(scene_, geometry_, ids_, before, scratch_, counters_);
    physics::add_contacts(scene_, scratch_.manifolds, before, after, quality_);
  }
  const physics::ContactQuality& quality() const { return quality_; }

 private:
  static physics::SceneDescription with_step(physics::SceneDescription scene, double dt_s) {
    scene.dt_s = dt_s;
    return scene;
  }

  const physics::SceneDescription scene_;
  const physics::Geometry geometry_;
  const std::vector<physics::BodyId> ids_;
  physics::StepScratch scratch_;
  physics::StageCounters counters_;
  physics::ContactQuality quality_;
};

// What looks at the states of a run, after so many steps of `dt_s`.
struct Watchers {
  Watchers(const Scenario& scenario, double dt_s_, std::int64_t steps)
      : dt_s(dt_s_), judges(judges_of(scenario, dt_s, steps)), contacts(scenario, dt_s) {}

  void see(std::int64_t step, std::span<const physics::BodyState> states) {
    for (const std::unique_ptr<Judge>& judge : judges)
      judge->see(dt_s * static_cast<double>(step), states);
  }

  const double dt_s;
  Judges judges;
  ContactWatch contacts;
};

struct WatchedRun {
  std::string fault;  // if any
  bool given_up = false;
};

// Runs forward, and back if that is asked for.
WatchedRun run_watched(Engine& engine, const Scenario& scenario, std::int64_t steps,
                       double budget_s, Watchers& watchers) {
  std::vector<physics::BodyState> states(scenario.initial), before;
  watchers.see(0, states);
  const std::int64_t all = reverses(scenario) ? 2 * steps : steps;
  const double start_s = thread_cpu_s();
  for (std::int64_t step = 1; step <= all; ++step) {
    if (step == steps + 1) {
      engine.reverse();
      engine.read(states);
    }
    engine.step();
    if (const std::string fault = engine.fault(); !fault.empty())
      return {"step " + std::to_string(step) + ": " + fault, false};
    before.swap(states);
    engine.read(states);
    watchers.contacts.see(before, states);
    watchers.see(step, states);
    if (thread_cpu_s() - start_s > budget_s && step < all) return {{}, true};
  }
  return {};
}

// CPU seconds of one run. Short ones are repeated, so that the clock's own cost vanishes.
double timed_once(const Scenario& scenario, const EngineKind& kind, const EngineSetting& setting,
                  std::int64_t steps) {
  constexpr double kShort_s = 0.01;
  double sum = 0.0;
  int runs = 0;
  do {
    const std::unique_ptr<Engine> engine = kind.make(scenario.scene, scenario.initial, setting);
    const double start = thread_cpu_s();
    for (std::int64_t step = 0; step < steps; ++step) engine->step();
    sum += thread_cpu_s() - start;
    ++runs;
  } while (sum < kShort_s && runs < 200);
  return sum / runs;
}

double median_cpu_s(const Scenario& scenario, const EngineKind& kind, const EngineSetting& setting,
                    std::int64_t steps, const RepeatRule& rule) {
  std::vector<double> times;
  for (int i = 0; i < rule.repeats; ++i) {
    times.push_back(timed_once(scenario, kind, setting, steps));
    if (times.back() > rule.long_enough_s) break;
  }
  std::sort(times.begin(), times.end());
  return times.empty() ? 0.0 : times[times.size() / 2];
}

void judge_measures(const scenarios::Reference& reference, const std::vector<Measured>& errors,
                    CaseRun& run) {
  for (const Measured& error : errors) {
    JudgedMeasure judged{reference.form, error.measure, error.value, {}, {}};
    for (const scenarios::Bound& bound : reference.bounds) {
      if (bound.measure != error.measure) continue;
      judged.must = bound.must;
      judged.stretch = bound.stretch;
    }
    run.measures.push_back(judged);
  }
}

}  // namespace

CaseRun run_case(const Scenario& scenario, const EngineKind& kind, const EngineSetting& setting,
                 const RepeatRule& rule) {
  CaseRun run;
  run.scene = scenario.name;
  run.engine = kind.name;
  run.setting = setting;
  run.steps = steps_at(scenario, setting.dt_s);
  const std::unique_ptr<Engine> engine = kind.make(scenario.scene, scenario.initial, setting);
  Watchers watchers(scenario, setting.dt_s, run.steps);
  const WatchedRun watched = run_watched(*engine, scenario, run.steps, rule.budget_s, watchers);
  run.fault = watched.fault;
  run.given_up = watched.given_up;
  run.contacts = watchers.contacts.quality();
  run.estimates = engine->estimates();
  if (!run.fault.empty() || run.given_up) return run;

  const double cpu_s = median_cpu_s(scenario, kind, setting, run.steps, rule);
  const double steps = static_cast<double>(run.steps);
  run.cpu_per_simulated_s = cpu_s / (steps * setting.dt_s);
  run.step_ms = 1e3 * cpu_s / steps;
  for (std::size_t i = 0; i < watchers.judges.size(); ++i) {
    std::vector<Measured> errors = watchers.judges[i]->errors();
    if (rule.repeats > 0) errors.push_back({"step_ms", run.step_ms});
    const scenarios::Reference& reference = scenario.references[i];
    // Cost is a measure only where a bound is set on it.
    std::erase_if(errors, [&](const Measured& error) {
      return error.measure == "step_ms" &&
             std::none_of(reference.bounds.begin(), reference.bounds.end(),
                          [](const scenarios::Bound& b) { return b.measure == "step_ms"; });
    });
    judge_measures(reference, errors, run);
  }
  return run;
}

}  // namespace soda::analysis
