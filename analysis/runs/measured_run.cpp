#include "analysis/runs/measured_run.hpp"

#include <algorithm>
#include <optional>

#include "analysis/measures/input_measures.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

std::string describe(const models::SimulationFault& fault) {
  return "step " + std::to_string(fault.step) + ", world " +
         std::to_string(models::index_of(fault.world)) + ", body " +
         std::to_string(fault.body_label) + ": " + fault.what;
}

std::vector<physics::BodyId> all_bodies(std::size_t count) {
  std::vector<physics::BodyId> ids;
  ids.reserve(count);
  for (std::size_t i = 0; i < count; ++i) ids.push_back(static_cast<physics::BodyId>(i));
  return ids;
}

void want_each_state(models::CommitObserver& observer) {
  observer.wants_states = true;
  observer.states_every = 1;
}

// "shape pair" -> "shape_pair": names of counters are keys of the JSON output.
std::string as_key(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ' ' || c == '-'; }, '_');
  return name;
}

}  // namespace

std::vector<physics::Vec3> centres(std::span<const physics::BodyState> states) {
  std::vector<physics::Vec3> positions;
  for (const physics::BodyState& state : states) positions.push_back(state.position_m);
  return positions;
}

MeasuredRun measure_run(const physics::SceneDescription& scene,
                        const std::vector<physics::BodyState>& initial,
                        const models::TerritoryOptions& territory,
                        const models::RunOptions& options, const models::CommitObserver& observer,
                        const std::function<void(const models::Progress&)>& progress) {
  const models::TerritoryMap map = models::make_territory_map(territory, centres(initial), &scene);
  MeasuredRun run;
  run.plan = models::make_plan(scene, map.worlds(), options);

  if (scene.tolerance > 0.0) run.estimates = ErrorEstimates{.tolerance = scene.tolerance};

  RunTotals totals;
  RunTotals of_committed;  // without what drives do in a step that may not come
  models::CommitObserver both = observer;
  const bool followed = is_followed(options.inputs);
  if (followed || states_are_measured(scene)) want_each_state(both);
  std::optional<InputFollower> follower;
  std::vector<physics::BodyId> start_ids;
  std::vector<physics::BodyState> start_states;
  PresentBodies start;
  if (followed) {
    follower.emplace(scene, initial, options.inputs);
    start_ids.assign(follower->bodies().ids.begin(), follower->bodies().ids.end());
    start_states.assign(follower->bodies().states.begin(), follower->bodies().states.end());
    start = {start_ids, start_states};
  } else {
    start_ids = all_bodies(initial.size());
    start = {start_ids, initial};
    if (options.steps > options.first_step) add_drives(scene, start_ids, initial, totals);
  }
  both.on_step = [&](const models::CommittedStep& step) {
    add_islands(step.islands, totals);
    if (run.estimates) add_estimates(scene, step.step, step.islands, *run.estimates);
    if (followed) follower->follow(step, totals);
    of_committed = totals;
    if (!followed && step.step < options.steps) add_drives(scene, step.ids, step.states, totals);
    if (observer.on_step) observer.on_step(step);
  };

  const Stopwatch stopwatch;
  run.result = models::simulate(scene, initial, map, options, both, progress);
  run.cost = stopwatch.elapsed();

  run.steps = run.result.committed_steps - options.first_step;

  if (run.result.fault) throw NumericalFailure(describe(*run.result.fault));
  std::vector<physics::BodyState> end_states;
  PresentBodies end{run.result.final_ids, run.result.final_states};
  if (end.ids.size() != end.states.size()) {
    for (const physics::BodyId id : run.result.final_ids)
      end_states.push_back(run.result.final_states[physics::index_of(id)]);
    end.states = end_states;
  }
  run.error = measure_errors(scene, start, end, static_cast<double>(run.steps), of_committed);
  run.digest = models::final_digest(run.result);
  run.plan_counters = models::plan_counters(run.plan, run.result);
  return run;
}

void take_part(const physics::SceneDescription& scene,
               const std::vector<physics::BodyState>& initial,
               const models::TerritoryOptions& territory, const models::RunOptions& options,
               const models::CommitObserver& observer) {
  const models::TerritoryMap map = models::make_territory_map(territory, centres(initial), &scene);
  models::CommitObserver own = observer;
  if (is_followed(options.inputs) || states_are_measured(scene)) want_each_state(own);
  models::simulate(scene, initial, map, options, own);
}

std::vector<std::string> broken_plan_lines(const MeasuredRun& run) {
  std::vector<std::string> broken;
  for (std::size_t i = 0; i < run.plan.size(); ++i) {
    if (run.plan[i].needed || run.plan_counters[i] == 0) continue;
    broken.push_back(run.plan[i].stage + ": not needed (" + run.plan[i].reason + "), but counted " +
                     std::to_string(run.plan_counters[i]));
  }
  return broken;
}

namespace {

using Counts = std::vector<std::pair<std::string, std::uint64_t>>;

void add_world_counts(const models::SimulationResult& result, Counts& counts) {
  const models::WorldCounters& worlds = result.worlds;
  const Counts more = {
      {"border_tests", worlds.border_tests},
      {"ghosts_sent", worlds.ghosts_sent},
      {"fragments_sent", worlds.fragments_sent},
      {"records_sent", worlds.records_sent},
      {"merge_rounds", worlds.merge_rounds},
      {"migrations", worlds.migrations},
      {"mixed_islands", worlds.mixed_islands},
      {"islands_reused", worlds.islands_reused},
      {"islands_split", worlds.islands_split},
      {"splits_given_up", worlds.splits_given_up},
      {"entries_saved", worlds.entries_saved},
      {"bytes_sent", worlds.bytes_sent},
      {"entries_stored", worlds.entries_stored},
      {"bodies_stored", worlds.bodies_stored},
      {"state_bytes_stored", worlds.state_bytes_stored},
      {"state_bytes_whole", worlds.state_bytes_whole},
      {"memo_bytes_stored", worlds.memo_bytes_stored},
      {"steps_repeated", worlds.steps_repeated},
      {"steps_put_back", worlds.steps_put_back},
      {"bags_absorbed", worlds.bags_absorbed},
      {"absorption_looks", worlds.absorption_looks},
      {"islands_repeated", worlds.islands_repeated},
      {"islands_taken", worlds.islands_taken},
      {"islands_warm", worlds.islands_warm},
      {"bodies_repeated", worlds.bodies_repeated},
      {"bodies_taken", worlds.bodies_taken},
      {"ghosts_guessed", worlds.ghosts_guessed},
      {"guesses_answered", worlds.guesses_answered},
      {"guesses_confirmed", worlds.guesses_confirmed},
      {"ghosts_answered", worlds.ghosts_answered},
      {"ghosts_confirmed", worlds.ghosts_confirmed},
      {"contacts_false", worlds.contacts_false},
      {"contacts_missed", worlds.contacts_missed},
      {"bodies_sampled", worlds.bodies_sampled},
      {"cells_transferred", result.territory_changes.size()},
  };
  counts.insert(counts.end(), more.begin(), more.end());
}

}  // namespace

Counts stage_counts(const models::SimulationResult& result) {
  const physics::StageCounters& stages = result.stages;
  Counts counts = {{"boxes", stages.boxes}, {"candidate_pairs", stages.candidate_pairs}};
  for (std::size_t kernel = 0; kernel < stages.narrowphase_tests.size(); ++kernel) {
    counts.emplace_back(
        "narrowphase_" + as_key(physics::name_of(static_cast<physics::ShapeKernel>(kernel))),
        stages.narrowphase_tests[kernel]);
  }
  const Counts rest = {
      {"fcl_calls", stages.fcl_calls},
      {"fcl_failures", stages.fcl_failures},
      {"manifolds", stages.manifolds},
      {"contact_points", stages.contact_points},
      {"free_bodies_advanced", stages.free_bodies_advanced},
      {"islands_solved", stages.islands_solved},
      {"islands_at_rest", stages.islands_at_rest},
      {"islands_again", stages.islands_again},
      {"pairs_at_rest", stages.pairs_at_rest},
      {"direct_islands", stages.direct_islands},
      {"solver_iterations", stages.solver_iterations},
      {"row_sweeps", stages.row_sweeps},
      {"factor_multiplications", stages.factor_multiplications},
      {"normal_rows", stages.normal_rows},
      {"friction_rows", stages.friction_rows},
      {"rolling_rows", stages.rolling_rows},
      {"conveyor_rows", stages.conveyor_rows},
      {"joint_rows", stages.joint_rows},
      {"joint_sweeps", stages.joint_sweeps},
      {"limit_rows", stages.limit_rows},
      {"motor_rows", stages.motor_rows},
      {"joints_broken", stages.joints_broken},
      {"restitution_rows", stages.restitution_rows},
      {"warm_started_rows", stages.warm_started_rows},
      {"impact_searches", stages.impact_searches()},
      {"impacts", stages.impacts},
      {"turned_searches", stages.turned_searches},
      {"turned_solves", stages.turned_solves},
      {"refined_steps", stages.refined_steps},
      {"islands_over_budget", stages.islands_over_budget},
      {"blows", stages.blows},
      {"blows_left", stages.blows_left},
      {"islands_in_blocks", stages.islands_in_blocks},
      {"blocks_solved", stages.blocks_solved},
      {"block_row_sweeps", stages.block_row_sweeps},
      {"driven_bodies", stages.driven_bodies},
      {"kinematic_bodies", stages.kinematic_bodies},
      {"forced_bodies", stages.forced_bodies},
  };
  counts.insert(counts.end(), rest.begin(), rest.end());
  add_world_counts(result, counts);
  return counts;
}

Counts island_counts(const models::SimulationResult& result) {
  return {{"committed", result.islands_committed},
          {"solved", result.stages.islands_solved},
          {"at_rest", result.stages.islands_at_rest},
          {"reused", result.worlds.islands_reused},
          {"split", result.worlds.islands_split},
          {"solves_committed", result.worlds.solves_committed}};
}

std::vector<std::uint32_t> broken_joints(const models::SimulationResult& result) {
  std::vector<std::uint32_t> labels;
  for (const physics::BodyState& state : result.final_states)
    labels.insert(labels.end(), state.broken_joints.begin(), state.broken_joints.end());
  std::ranges::sort(labels);
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  return labels;
}

double efficiency(const kernel::Counters& events) {
  if (events.executed == 0) return 0.0;
  return 1.0 - static_cast<double>(events.rolled_back) / static_cast<double>(events.executed);
}

double mean_lead_steps(const kernel::Counters& events) {
  if (events.executed == 0) return 0.0;
  return static_cast<double>(events.lead_sum) / static_cast<double>(events.executed);
}

}  // namespace soda::analysis
