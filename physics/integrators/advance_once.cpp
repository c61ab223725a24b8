#include "physics/integrators/advance_once.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/constraints/joint_impulses.hpp"
#include "physics/constraints/joint_loads.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/articulated_island.hpp"
#include "physics/integrators/end_contacts.hpp"
#include "physics/integrators/joint_closing.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/swept_motion.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/solvers/contact_choice.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/solve_choice.hpp"
#include "physics/solvers/split_solver.hpp"

namespace soda::physics {
namespace {

bool accept(BodyId id, const BodyState& next, std::vector<AdvanceFault>& faults) {
  const char* fault = fault_of(next);
  if (*fault) faults.push_back({id, fault});
  return !*fault;
}

// The rows of which body `a` is the lower one follow each other; `row` is the first that may be.
void store_impulses(const IndexedSpan<ContactManifold>& manifolds, const ContactProblem& problem,
                    std::size_t a, bool moved, std::size_t& row,
                    std::vector<ContactImpulse>& stored) {
  if (moved) stored.clear();
  for (; row < problem.normals.size() && problem.normals[row].a == a; ++row) {
    if (!moved || problem.normals[row].impulse_newton_s == 0.0) continue;
    stored.push_back(stored_impulse(manifolds, problem, row));
  }
}

void move_bodies(const IslandStep& island, const ContactProblem& problem,
                 const std::vector<PositionCorrection>& push, std::span<BodyState> states,
                 std::vector<AdvanceFault>& faults) {
  const Flights flights = find_flights(problem);
  std::size_t row = 0;
  for (std::size_t i = 0; i < island.ids.size(); ++i) {
    const bool moved = move_body({island.scene, island.dt_s, island.ids[i], problem.bodies[i],
                                  flights[i], push.empty() ? nullptr : &push[i]},
                                 states[i], faults);
    store_impulses(island.manifolds, problem, i, moved, row, states[i].impulses);
  }
}

void count_rows(const JointSystem& joints, StageCounters& counters) {
  counters.joint_rows += joints.rows.size();
  if (!joints.bounded) return;
  for (const JointRow& row : joints.rows) {
    counters.limit_rows += row.kind == JointRowKind::kLimit;
    counters.motor_rows += row.kind == JointRowKind::kMotor;
  }
}

}  // namespace

void store_jointed_impulses(const IslandStep& island, const ContactProblem& problem,
                            const JointSystem& joints, std::span<BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> places;  // of joints, by index
  for (std::uint32_t place = 0; place < joints.joints.size(); ++place)
    places.push_back({joints.joints[place], place});
  std::ranges::sort(places);
  for (BodyState& state : states) state.impulses.clear();
  std::size_t row = 0, body = 0;
  for (std::uint32_t m = 0; m < manifolds.size(); ++m) {
    while (ids[body] != manifolds[m].a) ++body;
    std::vector<ContactImpulse>& stored = states[body].impulses;
    if (is_joint(manifolds[m])) {
      const auto at =
          std::ranges::lower_bound(places, std::pair(joint_of(manifolds[m]), std::uint32_t{0}));
      append_joint_impulses(scene, at->second, joints, stored);
      continue;
    }
    for (; row < problem.normals.size() && problem.contacts[row].manifold == m; ++row)
      if (problem.normals[row].impulse_newton_s != 0.0)
        stored.push_back(stored_impulse(manifolds, problem, row));
  }
}

IslandReport report_of(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds) {
  IslandReport report;
  report.label = ids.front();
  report.bodies = static_cast<std::uint32_t>(ids.size());
  for (const ContactManifold& m : manifolds) report.contact_points += m.count;
  return report;
}

// Of an island that joints alone have moved.
void count_linked(const SceneDescription& scene, std::span<const BodyId> ids,
                  const JointSystem& joints, const IslandReport& report, StageCounters& counters) {
  for (const BodyId id : ids) {
    counters.driven_bodies += scene.bodies[index_of(id)].drive != kNoDrive;
    counters.forced_bodies += is_forced(scene.bodies[index_of(id)]);
  }
  counters.solver_iterations += report.iterations;
  count_rows(joints, counters);
}

void add_part(const IslandReport& part, IslandReport& report) {
  report.contact_points = std::max(report.contact_points, part.contact_points);
  report.direct = report.direct || part.direct;
  report.iterations += part.iterations;
  report.multiplications += part.multiplications;
  report.max_penetration_m = std::max(report.max_penetration_m, part.max_penetration_m);
  report.overlap_growth = std::max(report.overlap_growth, part.overlap_growth);
  report.constraint_residual_m_s =
      std::max(report.constraint_residual_m_s, part.constraint_residual_m_s);
  report.joint_error = part.joint_error;
  report.push_out_work_joule += part.push_out_work_joule;
  if (part.error_estimate > 0.0) report.worst_body = part.worst_body;
  report.error_estimate += part.error_estimate;
  report.beyond_tolerance = report.beyond_tolerance || part.beyond_tolerance;
  report.motor_work_joule += part.motor_work_joule;
  report.static_impulse_newton_s += part.static_impulse_newton_s;
  report.static_angular_impulse_newton_m_s += part.static_angular_impulse_newton_m_s;
  for (const JointLoad& load : part.joint_loads) add_load(load, report);
}

namespace {

// Rows at the bodies' velocities after external forces. The bodies are the states' of the step.
void build_problem(const SolveStep& step, const IslandStep& island, SolveScratch& scratch,
                   StageCounters& counters) {
  ContactProblem& problem = scratch.problem;
  problem.clear();
  load_bodies(step, problem.bodies, counters);
  scratch.free.assign(problem.bodies.begin(), problem.bodies.end() - 1);
  build_rows(step, island.manifolds, problem, counters);
}

void count_solution(const ContactSolution& solution, const ContactProblem& problem,
                    IslandReport& report, StageCounters& counters) {
  report.direct = solution.direct;
  report.iterations = solution.iterations;
  report.multiplications = solution.multiplications;
  counters.solver_iterations += solution.iterations;
  counters.row_sweeps += solution.iterations * rows_of(problem);
  counters.factor_multiplications += solution.multiplications;
  counters.blows += solution.blows;
  counters.blows_left += solution.blows_left;
}

// Leaves errors alone in the rows.
double error_at(const SceneDescription& scene, std::span<const BodyState> states,
                JointSystem& joints) {
  build_joint_errors(scene, states, joints);
  return largest_error(joints);
}

void close_open(const IslandStep& island, JointSystem& joints, std::span<BodyState> states,
                IslandReport& report, SolveScratch& scratch) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (are_closed(scene, dt_s, states, joints)) return;
  const bool touched = report.contact_points > 0;
  StageCounters uncounted;  // the step makes these rows once more
  if (touched)
    build_problem({scene, dt_s, ids, IndexedSpan<BodyState>{std::span<const BodyState>(states)}},
                  island, scratch, uncounted);
  close_left_open(island, touched ? &scratch.problem : nullptr, joints, states, report);
}

// Joints that nothing touches are an articulated island, where they do not contradict each other.
bool is_articulated(const IslandStep& island, JointSystem& joints, std::span<BodyState> states,
                    IslandReport& report, const IslandEffects& effects) {
  if (report.contact_points > 0) return false;
  if (!advance_articulated(island, joints, states, report, effects.faults)) return false;
  report.joint_error = error_at(island.scene, states, joints);
  count_linked(island.scene, island.ids, joints, report, effects.counters);
  return true;
}

IslandReport advance_with_joints(const IslandStep& island, Exactness how,
                                 const JointedChoice& choice, JointSystem& joints,
                                 std::span<BodyState> states, const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [scratch, counters, faults] = effects;
  IslandReport report = report_of(ids, manifolds);
  if (!choice.swept) {
    close_open(island, joints, states, report, scratch);
    if (is_articulated(island, joints, states, report, effects)) return report;
  }
  const std::vector<BodyState> start(states.begin(), states.end());
  const IndexedSpan<BodyState> before{std::span<const BodyState>(start)};
  ContactProblem& problem = scratch.problem;
  build_problem({scene, dt_s, ids, before}, island, scratch, counters);
  const JointedStep step{island, start, scratch.free};
  std::optional<ContactSolution> direct;
  if (choice.elimination && !choice.swept)
    direct = solve_jointed_directly(step, how != Exactness::kOngoing, *choice.elimination, joints,
                                    problem);
  std::optional<std::uint32_t> iterations;
  if (!direct && choice.swept_else) {
    iterations = advance_swept(step, choice.substeps, {joints, problem}, states, report);
    if (!iterations) build_problem({scene, dt_s, ids, before}, island, scratch, counters);
  }
  ContactSolution solution;
  if (iterations) {
    solution.iterations = *iterations;
    counters.joint_sweeps += *iterations * joints.rows.size();
    ++counters.islands_over_budget;
  } else {
    solution = direct ? std::move(*direct) : solve_jointed(step, joints, problem);
    report_joints(start, joints, report);
    move_jointed(step, {joints, problem, solution.push, how == Exactness::kCompared}, states,
                 report, faults);
  }
  report.constraint_residual_m_s = std::max(report.constraint_residual_m_s, residual_m_s(problem));
  report_contacts(before, problem, report);
  count_rows(joints, counters);
  count_solution(solution, problem, report, counters);
  store_jointed_impulses(island, problem, joints, states);
  if (!iterations) report.joint_error = error_at(scene, states, joints);
  return report;
}

// How the contacts of an island without joints are solved.
struct ContactSolve {
  bool accurate;
  const Elimination* plan;  // or null
};

IslandReport solve_contacts_once(const IslandStep& island, const ContactSolve& how,
                                 std::span<BodyState> states, std::vector<PositionCorrection>& push,
                                 const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [scratch, counters, faults] = effects;
  IslandReport report = report_of(ids, manifolds);
  const SolveStep step{scene, dt_s, ids,
                       IndexedSpan<BodyState>{std::span<const BodyState>(states)}};
  ContactProblem& problem = scratch.problem;
  build_problem(step, island, scratch, counters);
  ContactSolution solution = solve_contacts(step, how.accurate, scratch.free, how.plan, problem);
  count_solution(solution, problem, report, counters);
  report.constraint_residual_m_s = residual_m_s(problem);
  report_contacts(step.before, problem, report);
  push = std::move(solution.push);
  move_bodies(island, problem, push, states, faults);
  report.push_out_work_joule = push_out_work_joule(scene, dt_s, ids, push);
  return report;
}

// What the step began with is told by its first solve.
void take_over(const IslandReport& first, IslandReport& report) {
  report.contact_points = first.contact_points;
  report.max_penetration_m = first.max_penetration_m;
  report.iterations += first.iterations;
  report.multiplications += first.multiplications;
}

// As they were, but for the impulses that the last solve found.
void go_back(std::span<const BodyState> start, std::span<BodyState> states) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    std::vector<ContactImpulse> impulses = std::move(states[i].impulses);
    states[i] = start[i];
    states[i].impulses = std::move(impulses);
  }
}

// Solved anew with what has come round, and with what bodies have been sent to; of these solves
// that by which least sinks in.
IslandReport advance_contacts(const IslandStep& island, const ContactSolve& how,
                              std::span<BodyState> states, const IslandEffects& effects) {
  const auto& [scratch, counters, faults] = effects;
  std::vector<BodyState> start;
  for (const BodyState& state : states) start.push_back(motion_of(state));
  std::vector<PositionCorrection> push;
  IslandReport report = solve_contacts_once(island, how, states, push, effects);
  std::vector<ContactManifold> contacts(island.manifolds.begin(), island.manifolds.end());
  const bool sent = add_unseen_statics(island, {start, states, push}, counters, contacts),
             round = shows_other_points(island.scene, island.ids) &&
                     can_come_round(island, {start, states, push});
  if (!sent && !round) return report;
  report.overlap_growth =
      find_end_contacts(island, {start, states, push}, round, counters, contacts);
  if (report.overlap_growth <= kMostGrowth) return report;
  std::vector<BodyState> trial(states.begin(), states.end());
  double growth = report.overlap_growth;
  const int most = most_end_solves(report.contact_points);
  for (int solve = 0; solve < most && growth > kMostGrowth; ++solve) {
    go_back(start, trial);
    const std::size_t faults_before = faults.size();
    IslandReport again =
        solve_contacts_once(island.over(island.dt_s, contacts), how, trial, push, effects);
    ++counters.turned_solves;
    if (faults.size() > faults_before) {
      faults.resize(faults_before);
      break;
    }
    add_unseen_statics(island, {start, trial, push}, counters, contacts);
    growth = find_end_contacts(island, {start, trial, push}, round, counters, contacts);
    if (!(growth < report.overlap_growth)) continue;
    again.overlap_growth = growth;
    take_over(report, again);
    report = std::move(again);
    std::copy(trial.begin(), trial.end(), states.begin());
  }
  return report;
}

}  // namespace

IslandReport advance_once(const IslandStep& island, Exactness how, std::span<BodyState> states,
                          const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const bool accurate = how != Exactness::kOngoing;
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (!joints.empty()) {
    const JointedChoice choice = choose_jointed_solve(island, accurate, states, joints);
    return advance_with_joints(island, how, choice, joints, states, effects);
  }
  const SolveChoice choice = choose_solve(scene, dt_s, accurate, ids, manifolds, states);
  if (!choice.blocks)
    return advance_contacts(island, {accurate, choice.elimination ? &*choice.elimination : nullptr},
                            states, effects);
  IslandReport report = report_of(ids, manifolds);
  advance_blocks({scene, dt_s, ids, manifolds, states, *choice.blocks}, states, report,
                 effects.counters, effects.faults);
  return report;
}

IslandReport advance_substep(const IslandStep& island, std::span<BodyState> states,
                             const IslandEffects& effects) {
  JointSystem joints = find_joints(island.scene, island.ids, island.manifolds);
  const JointedChoice swept{.elimination = {}, .swept = true, .swept_else = true, .substeps = 1};
  return advance_with_joints(island, Exactness::kOngoing, swept, joints, states, effects);
}

void advance_free_body(const SceneDescription& scene, double dt_s, BodyId id, BodyState& state,
                       StageCounters& counters, std::vector<AdvanceFault>& faults) {
  ++counters.free_bodies_advanced;
  if (scene.bodies[index_of(id)].joints > 0)
    report_lost_joints(scene, {&id, 1}, {}, {&state, 1}, faults);
  const BodyParams& params = scene.bodies[index_of(id)];
  BodyState next;
  if (is_pushed(params)) {
    next = motion_of(state);
    fly(scene, dt_s, id, next);
    counters.driven_bodies += params.drive != kNoDrive;
  } else {
    next = flown(scene, id, state, dt_s);
  }
  counters.forced_bodies += is_forced(params);
  if (!accept(id, next, faults)) return;
  next.impulses = std::move(state.impulses);
  next.impulses.clear();
  state = std::move(next);
}

}  // namespace soda::physics
