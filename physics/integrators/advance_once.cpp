#include "physics/integrators/advance_once.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_impulses.hpp"
#include "physics/constraints/joint_loads.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/linkage.hpp"
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
void store_impulses(const Selection<ContactManifold>& manifolds, const ContactProblem& problem,
                    std::size_t a, bool moved, std::size_t& row,
                    std::vector<ContactImpulse>& stored) {
  if (moved) stored.clear();
  for (; row < problem.normals.size() && problem.normals[row].a == a; ++row) {
    if (!moved || problem.normals[row].impulse_newton_s == 0.0) continue;
    stored.push_back(stored_impulse(manifolds, problem, row));
  }
}

// Both kinds in the manifolds' order.
void store_jointed_impulses(const SceneDescription& scene, std::span<const BodyId> ids,
                            std::span<const ContactManifold> manifolds,
                            const ContactProblem& problem, const JointSystem& joints,
                            std::span<BodyState> states) {
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

// Directly, where that is possible.
ContactSolution solve_with_joints(const JointedStep& step, bool accurate, const Elimination* plan,
                                  JointSystem& joints, ContactProblem& problem) {
  std::optional<ContactSolution> direct;
  if (plan != nullptr) direct = solve_jointed_directly(step, accurate, *plan, joints, problem);
  return direct ? std::move(*direct) : solve_jointed(step, joints, problem);
}

void move_bodies(const IslandStep& island, const ContactProblem& problem,
                 const std::vector<PushOut>& push, std::span<BodyState> states,
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
    counters.forced_bodies += scene.bodies[index_of(id)].forces != kNone;
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
  report.constraint_residual_m_s =
      std::max(report.constraint_residual_m_s, part.constraint_residual_m_s);
  report.push_out_work_joule += part.push_out_work_joule;
  if (part.error_estimate > 0.0) report.worst_body = part.worst_body;
  report.error_estimate += part.error_estimate;
  report.beyond_tolerance = report.beyond_tolerance || part.beyond_tolerance;
  report.motor_work_joule += part.motor_work_joule;
  report.static_impulse_newton_s += part.static_impulse_newton_s;
  report.static_angular_impulse_newton_m_s += part.static_angular_impulse_newton_m_s;
  for (const JointLoad& load : part.joint_loads) add_load(load, report);
}

IslandReport advance_once(const IslandStep& island, bool accurate, std::span<BodyState> states,
                          const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [scratch, counters, faults] = effects;
  IslandReport report = report_of(ids, manifolds);
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (!joints.empty()) close_left_open(island, joints, states, report);
  const bool linked = !joints.empty() && report.contact_points == 0 &&
                      advance_linkage(island, joints, states, report, faults);
  if (linked) {
    count_linked(scene, ids, joints, report, counters);
    return report;
  }
  const SolveChoice choice = choose_solve(scene, dt_s, accurate, ids, manifolds, states);
  if (choice.blocks) {
    advance_blocks({scene, dt_s, ids, manifolds, states, *choice.blocks}, states, report, counters,
                   faults);
    return report;
  }
  ContactProblem& problem = scratch.problem;
  problem.clear();
  const Selection<BodyState> before{std::span<const BodyState>(states)};
  const SolveStep step{scene, dt_s, ids, before};
  load_bodies(step, problem.bodies, counters);
  std::vector<SolverBody>& free = scratch.free;
  free.assign(problem.bodies.begin(), problem.bodies.end() - 1);
  build_rows(step, manifolds, problem, counters);
  if (joints.empty()) start_rolling(scene.solver.iterations, problem);
  const Elimination* const plan = choice.elimination ? &*choice.elimination : nullptr;
  const ContactSolution solution =
      joints.empty() ? solve_contacts(step, accurate, free, plan, problem)
                     : solve_with_joints({island, states, free}, accurate, plan, joints, problem);
  report.direct = solution.direct;
  report.iterations = solution.iterations;
  report.multiplications = solution.multiplications;
  count_rows(joints, counters);
  report.constraint_residual_m_s = residual_m_s(problem);
  report_contacts(before, problem, report);
  report_joints(states, joints, report);
  if (joints.empty()) {
    move_bodies(island, problem, solution.push, states, faults);
    report.push_out_work_joule = push_out_work_joule(scene, dt_s, ids, solution.push);
  } else {
    const std::vector<BodyState> start(states.begin(), states.end());
    move_jointed({island, start, free}, {joints, problem, solution.push}, states, report, faults);
    store_jointed_impulses(scene, ids, manifolds, problem, joints, states);
  }
  counters.solver_iterations += solution.iterations;
  counters.row_sweeps += solution.iterations * rows_of(problem);
  counters.factor_multiplications += solution.multiplications;
  counters.blows += solution.blows;
  counters.blows_left += solution.blows_left;
  return report;
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
    counters.forced_bodies += params.forces != kNone;
  } else {
    next = flown(scene, id, state, dt_s);
  }
  if (!accept(id, next, faults)) return;
  next.impulses = std::move(state.impulses);
  next.impulses.clear();
  state = std::move(next);
}

}  // namespace soda::physics
