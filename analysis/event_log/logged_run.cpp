#include "analysis/event_log/logged_run.hpp"

#include <algorithm>
#include <numeric>
#include <ostream>

#include "analysis/event_log/checkpoint.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "physics/math/disjoint_sets.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using scenarios::ScenarioExtent;

[[noreturn]] void refuse(const LogReader& log, const std::string& why) {
  throw scenarios::FileError(log.file() + ": " + why + ", which the logged scenario does not have");
}

void check_bodies(const LogReader& log, const scenarios::Scenario& scenario) {
  const std::vector<physics::BodyParams>& bodies = scenario.scene.bodies;
  const std::vector<std::uint32_t>& labels = log.labels();
  if (labels.size() != bodies.size())
    refuse(log, "block 2 lists " + std::to_string(labels.size()) + " bodies");
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i] != bodies[i].label)
      refuse(log, "block 2 lists body " + std::to_string(labels[i]));
}

// `worlds` of the logged run: a replay may have others.
void check_territories(const LogReader& log, const StepHead& step, std::size_t cells,
                       std::uint32_t worlds) {
  for (const models::TerritoryChange& change : step.territory_changes) {
    if (change.cell >= cells)
      refuse(log, log.place_of(step.step) + " gives away cell " + std::to_string(change.cell));
    for (const models::WorldId world : {change.from, change.to})
      if (models::index_of(world) >= worlds)
        refuse(log,
               log.place_of(step.step) + " names world " + std::to_string(models::index_of(world)));
  }
}

// Of a contact, or of a joint's push, the other body.
bool has_its_other(const physics::ContactImpulse& impulse, const physics::SceneDescription& scene) {
  if (impulse.part >= physics::kFirstJointPart &&
      impulse.part - physics::kFirstJointPart >= scene.joints.size())
    return false;
  if (impulse.other == physics::kWorldBody) return impulse.part >= physics::kFirstJointPart;
  return physics::is_static(impulse.other)
             ? physics::static_index_of(impulse.other) < scene.statics.size()
             : physics::index_of(impulse.other) < scene.bodies.size();
}

void check_impulses(const LogReader& log, const LoggedStep& step,
                    const physics::SceneDescription& scene) {
  for (const physics::BodyState& state : step.states) check_state(log, step.step, state, scene);
}

void check_motors(const LogReader& log, const StepHead& step,
                  const std::vector<physics::Joint>& joints) {
  for (const models::CommittedInput& committed : step.inputs) {
    const models::UserInput& input = committed.input;
    if (input.kind != models::InputKind::kSetMotor) continue;
    if (input.joint >= joints.size() || !joints[input.joint].motor)
      refuse(log, log.place_of(step.step) + " has an input for a motor that is not there");
  }
}

// A replay need not be started by mpirun: then as many threads stand for a job.
Overrides options_of_run(const LoggedOptions& logged) {
  Overrides overrides = logged.overrides;
  if (logged.ranks == 0) return overrides;
  constexpr unsigned kMostThreads = 1024;  // as on the command line
  overrides.executor = models::ExecutorKind::kThreads;
  overrides.threads = static_cast<unsigned>(std::min<std::uint64_t>(
      kMostThreads, std::uint64_t{logged.ranks} * overrides.threads.value_or(1)));
  return overrides;
}

// As far as it was asked to run.
scenarios::Scenario scenario_of(const LogReader& log, const Overrides& overrides,
                                ScenarioExtent extent = ScenarioExtent::kAll) {
  const scenarios::MeshFiles meshes{.folder = "", .kept = &log.meshes(), .read = nullptr};
  scenarios::Scenario scenario =
      scenarios::read_scenario_text(log.scenario().text, log.scenario().file, overrides.seed,
                                    meshes, overrides.strict ? ScenarioExtent::kAll : extent);
  if (overrides.strict) refuse_warnings(log.scenario().file, scenario.warnings);
  check_bodies(log, scenario);
  return scenario;
}

// Begins at a step, after what had acted before: its lasting effects are the scene's, and who is
// there follows from it. The states are void.
void begin_at(const LogReader& log, std::int64_t step, std::span<const physics::BodyId> ids,
              std::vector<models::CommittedInput> acted, scenarios::Scenario& scenario) {
  models::Presence presence(scenario.run.inputs.absent);
  std::vector<physics::BodyId> none;
  std::vector<physics::BodyState> no_states;
  for (const models::CommittedInput& committed : acted)
    if (presence.note(committed.input))
      models::act_on_scene(committed.input, scenario.scene, none, no_states);
  auto there = ids.begin();
  for (std::uint32_t body = 0; body < scenario.scene.bodies.size(); ++body) {
    const bool is_there = there != ids.end() && *there == physics::BodyId{body};
    if (is_there != presence.has(physics::BodyId{body}))
      throw scenarios::FileError(log.file() + ": " + log.place_of(step) +
                                 " has other bodies than the inputs before it leave");
    there += is_there ? 1 : 0;
  }
  scenario.run.first_step = step;
  scenario.run.inputs.absent = presence.absent();
  scenario.run.inputs.acted = std::move(acted);
}

void begin_with(const LogReader& log, const LoggedStep& at,
                std::vector<models::CommittedInput> acted, scenarios::Scenario& scenario) {
  begin_at(log, at.step, at.ids, std::move(acted), scenario);
  scenario.declared = scenario.initial;
  for (std::size_t i = 0; i < at.ids.size(); ++i)
    scenario.initial[physics::index_of(at.ids[i])] = at.states[i];
}

// What has acted when a step begins, in that order, and what is known to act later.
struct LoggedInputs {
  std::vector<models::CommittedInput> acted;
  std::vector<models::UserInput> to_come;
};

// At step `end`. Checks what it reads: all but states.
LoggedInputs inputs_around(LogReader& log, std::int64_t end, const scenarios::Scenario& scenario,
                           std::uint32_t worlds) {
  const std::size_t cells = scenario.territory.grid.cell_count();
  LoggedInputs inputs;
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step) {
    const StepHead head = log.read_head(step);
    check_territories(log, head, cells, worlds);
    check_motors(log, head, scenario.scene.joints);
    for (const models::CommittedInput& committed : head.inputs) {
      if (committed.input.step < end)
        inputs.acted.push_back(committed);
      else
        inputs.to_come.push_back(committed.input);
    }
  }
  return inputs;
}

// As resumed_scenario(), with everything but states. `acted` gets what acted before.
scenarios::Scenario resumed_inputs(LogReader& log, std::int64_t from, ScenarioExtent extent,
                                   Overrides& options, std::vector<models::CommittedInput>& acted) {
  const Overrides own = options_of_run(log.options());
  options = combined(own, options);
  scenarios::Scenario scenario = scenario_of(log, options, extent);
  const std::uint32_t worlds = own.worlds.value_or(scenario.territory.worlds);
  apply_overrides(options, scenario.territory, scenario.run);
  if (scenario.run.steps < from)
    throw UsageError("--steps: found " + std::to_string(scenario.run.steps) +
                     "; allowed: at least " + std::to_string(from) + ", with which " + log.file() +
                     " goes on");
  auto [before, to_come] = inputs_around(log, from, scenario, worlds);
  std::vector<models::CommittedInput> known = before;
  for (const models::UserInput& input : to_come) known.push_back({input, input.step, false});
  for (models::UserInput& input : still_to_come(scenario.run.inputs.script, known))
    to_come.push_back(std::move(input));
  scenario.run.inputs.script = std::move(to_come);
  acted = std::move(before);
  return scenario;
}

}  // namespace

scenarios::Scenario logged_scenario(LogReader& log, const Overrides& more) {
  const Overrides own = options_of_run(log.options());
  const Overrides overrides = combined(own, more);
  scenarios::Scenario scenario = scenario_of(log, overrides);
  const std::uint32_t worlds = own.worlds.value_or(scenario.territory.worlds);
  apply_overrides(overrides, scenario.territory, scenario.run);
  scenario.run.steps = std::min(scenario.run.steps, log.last_step());
  scenario.run.inputs.script.clear();
  LoggedInputs inputs = inputs_around(log, log.first_step(), scenario, worlds);
  scenario.run.inputs.script = std::move(inputs.to_come);
  for (std::int64_t step = log.first_step(); step <= log.last_step(); ++step)
    check_impulses(log, log.read_step(step), scenario.scene);
  if (log.first_step() > 0)
    begin_with(log, log.read_step(log.first_step()), std::move(inputs.acted), scenario);
  return scenario;
}

scenarios::Scenario resumed_scenario(LogReader& log, std::int64_t from, Overrides& options) {
  const LoggedStep at = log.read_states(from);
  std::vector<models::CommittedInput> acted;
  scenarios::Scenario scenario = resumed_inputs(log, at.step, ScenarioExtent::kAll, options, acted);
  check_impulses(log, at, scenario.scene);
  begin_with(log, at, std::move(acted), scenario);
  return scenario;
}

scenarios::Scenario resumed_without_states(LogReader& log, std::int64_t from,
                                           std::span<const physics::BodyId> ids,
                                           ScenarioExtent extent, Overrides& options) {
  std::vector<models::CommittedInput> acted;
  scenarios::Scenario scenario = resumed_inputs(log, from, extent, options, acted);
  begin_at(log, from, ids, std::move(acted), scenario);
  return scenario;
}

void check_state(const LogReader& log, std::int64_t step, const physics::BodyState& state,
                 const physics::SceneDescription& scene) {
  for (const physics::ContactImpulse& impulse : state.impulses)
    if (!has_its_other(impulse, scene))
      refuse(log, log.place_of(step) + " has an impulse with a body, static or joint");
}

std::int64_t asked_steps(const LogReader& log) {
  return log.options().overrides.steps.value_or(
      scenario_of(log, options_of_run(log.options()), ScenarioExtent::kNoStates).run.steps);
}

void tell_flaws(const LogReader& log, const std::string& file, std::ostream& err) {
  if (!log.cut().empty())
    err << "soda: " << file << ": " << log.cut() << "; read up to step " << log.last_step() << "\n";
  if (!log.damage().empty()) err << "soda: " << file << ": damaged: " << log.damage() << "\n";
}

void require_numbers(const LogReader& log, const LoggedStep& logged) {
  for (std::size_t i = 0; i < logged.ids.size(); ++i) {
    const physics::BodyState& state = logged.states[i];
    if (state.position_m.allFinite() && state.orientation.coeffs().allFinite() &&
        state.linear_velocity_m_s.allFinite() && state.angular_velocity_rad_s.allFinite())
      continue;
    throw scenarios::FileError(log.file() + ": " + log.place_of(logged.step) + ": body " +
                               std::to_string(log.labels()[physics::index_of(logged.ids[i])]) +
                               " has a state that is no number");
  }
}

void follow_changes(const LoggedStep& logged, models::TerritoryMap& map) {
  if (logged.territory_changes.empty()) return;
  std::vector<models::CellTransfer> transfers;
  for (const models::TerritoryChange& change : logged.territory_changes)
    transfers.push_back({change.cell, change.to});
  map = map.after(transfers);
}

std::vector<std::uint32_t> islands_of(const LoggedStep& logged,
                                      const physics::SceneDescription& scene) {
  // The root of a set is its smallest member: ids ascend.
  std::vector<std::uint32_t> parent(logged.ids.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto join = [&](std::uint32_t a, physics::BodyId id) {
    const auto found = std::ranges::lower_bound(logged.ids, id);
    if (found == logged.ids.end() || *found != id) return;
    const auto b = static_cast<std::uint32_t>(found - logged.ids.begin());
    const std::uint32_t root_a = physics::find_root(parent, a),
                        root_b = physics::find_root(parent, b);
    parent[std::max(root_a, root_b)] = std::min(root_a, root_b);
  };
  for (std::uint32_t i = 0; i < parent.size(); ++i)
    for (const physics::ContactImpulse& impulse : logged.states[i].impulses) join(i, impulse.other);
  for (const physics::Joint& joint : scene.joints) {
    const auto a = std::ranges::lower_bound(logged.ids, joint.a);
    if (a == logged.ids.end() || *a != joint.a) continue;
    const auto i = static_cast<std::uint32_t>(a - logged.ids.begin());
    if (!physics::is_broken(joint, logged.states[i])) join(i, joint.b);
  }
  for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = physics::find_root(parent, i);
  return parent;
}

}  // namespace soda::analysis
