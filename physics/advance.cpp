#include "physics/advance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/contact_choice.hpp"
#include "physics/forces.hpp"
#include "physics/geometry.hpp"
#include "physics/hits.hpp"
#include "physics/impacts.hpp"
#include "physics/island_motion.hpp"
#include "physics/joint_motion.hpp"
#include "physics/late_impacts.hpp"
#include "physics/linkage.hpp"
#include "physics/linked_step.hpp"
#include "physics/momentum.hpp"
#include "physics/reach.hpp"
#include "physics/refined_trials.hpp"
#include "physics/refinement.hpp"
#include "physics/rest.hpp"
#include "physics/rigid_motion.hpp"
#include "physics/solve_choice.hpp"
#include "physics/split_solver.hpp"
#include "physics/springs.hpp"
#include "physics/time_of_impact.hpp"

namespace soda::physics {
namespace {

// As `state`, but for the impulses.
BodyState motion_of(const BodyState& state) {
  BodyState motion;
  motion.position_m = state.position_m;
  motion.orientation = state.orientation;
  motion.linear_velocity_m_s = state.linear_velocity_m_s;
  motion.angular_velocity_rad_s = state.angular_velocity_rad_s;
  return motion;
}

bool accept(BodyId id, const BodyState& next, std::vector<AdvanceFault>& faults) {
  const char* fault = fault_of(next);
  if (*fault) faults.push_back({id, fault});
  return !*fault;
}

IslandReport report_of(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds) {
  IslandReport report;
  report.label = ids.front();
  report.bodies = static_cast<std::uint32_t>(ids.size());
  for (const ContactManifold& m : manifolds) report.contact_points += m.count;
  return report;
}

// Detection only: contacts are reported, bodies move as if they touched nothing.
void pass_through(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                  std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                  IslandReport& report, StageCounters& counters,
                  std::vector<AdvanceFault>& faults) {
  for (const ContactManifold& m : manifolds) {
    for (std::uint32_t i = 0; i < m.count; ++i) {
      report.max_penetration_m = std::max(report.max_penetration_m, -m.points[i].separation_m);
    }
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    advance_free_body(scene, dt_s, ids[i], states[i], counters, faults);
  }
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

void store_all_impulses(const Selection<ContactManifold>& manifolds, const ContactProblem& problem,
                        std::span<BodyState> states) {
  std::size_t row = 0;
  for (std::size_t i = 0; i < states.size(); ++i)
    store_impulses(manifolds, problem, i, true, row, states[i].impulses);
}

void move_bodies(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                 std::span<const ContactManifold> manifolds, const ContactProblem& problem,
                 const std::vector<PushOut>& push, std::span<BodyState> states,
                 std::vector<AdvanceFault>& faults) {
  const Flights flights = find_flights(problem);
  std::size_t row = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const bool moved = move_body(scene, dt_s, ids[i], problem.bodies[i], flights[i],
                                 push.empty() ? nullptr : &push[i], states[i], faults);
    store_impulses(manifolds, problem, i, moved, row, states[i].impulses);
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

}  // namespace

SolverBody solver_body(const BodyParams& params, const BodyState& state) {
  return {.linear = state.linear_velocity_m_s,
          .angular = state.angular_velocity_rad_s,
          .inverse_mass = 1.0 / params.mass_kg,
          .inverse_inertia = is_isotropic(params.inertia_local_kg_m2)
                                 ? params.inverse_inertia_local
                                 : rotated_tensor(state.orientation.toRotationMatrix(),
                                                  params.inverse_inertia_local)};
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
}

IslandReport advance_once(const SceneDescription& scene, double dt_s, bool accurate,
                          std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                          std::span<BodyState> states, SolveScratch& scratch,
                          StageCounters& counters, std::vector<AdvanceFault>& faults) {
  IslandReport report = report_of(ids, manifolds);
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (!joints.empty()) close_left_open(scene, dt_s, ids, joints, states, report);
  const bool linked = !joints.empty() && report.contact_points == 0 &&
                      advance_linkage(scene, dt_s, ids, joints, states, report, faults);
  if (linked) {
    count_linked(scene, ids, joints, report, counters);
    return report;
  }
  const SolveChoice choice = choose_solve(scene, dt_s, accurate, ids, manifolds, states);
  if (choice.blocks) {
    advance_blocks({scene, ids, manifolds, states, *choice.blocks}, states, report, counters,
                   faults);
    return report;
  }
  ContactProblem& problem = scratch.problem;
  problem.clear();
  const Selection<BodyState> before{std::span<const BodyState>(states)};
  load_bodies(scene, dt_s, ids, before, problem.bodies, counters);
  std::vector<SolverBody>& free = scratch.free;
  free.assign(problem.bodies.begin(), problem.bodies.end() - 1);
  build_rows(scene, dt_s, ids, manifolds, before, problem, counters);
  const ContactSolution solution =
      joints.empty() ? solve_contacts(scene, dt_s, accurate, ids, before, free,
                                      choice.elimination ? &*choice.elimination : nullptr, problem)
                     : solve_jointed({scene, dt_s, ids, states, free}, joints, problem);
  report.direct = solution.direct;
  report.iterations = solution.iterations;
  report.multiplications = solution.multiplications;
  count_rows(joints, counters);
  report.constraint_residual_m_s = residual_m_s(problem);
  report_contacts(before, problem, report);
  report_joints(states, joints, report);
  if (joints.empty()) {
    move_bodies(scene, dt_s, ids, manifolds, problem, solution.push, states, faults);
    report.push_out_work_joule = push_out_work_joule(scene, dt_s, ids, solution.push);
  } else {
    const std::vector<BodyState> start(states.begin(), states.end());
    move_jointed({scene, dt_s, ids, start, free}, joints, problem, solution.push, states, report,
                 faults);
    store_all_impulses(manifolds, problem, states);
  }
  counters.solver_iterations += solution.iterations;
  counters.row_sweeps += solution.iterations * rows_of(problem);
  counters.factor_multiplications += solution.multiplications;
  return report;
}

namespace {

// Contacts do not tell: bodies that hit each other may come to statics within the step.
bool has_met_no_static(const IslandReport& report) {
  return report.static_impulse_newton_s == Vec3::Zero() &&
         report.static_angular_impulse_newton_m_s == Vec3::Zero();
}

// One spring, if its motion has a closed form: no step to refine.
bool advance_exactly(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                     IslandReport& report, StageCounters& counters,
                     std::vector<AdvanceFault>& faults) {
  if (manifolds.size() != 1 || !is_joint(manifolds.front()) ||
      scene.joints[joint_of(manifolds.front())].kind != JointKind::kSpring)
    return false;
  const JointSystem joints = find_joints(scene, ids, manifolds);
  report = report_of(ids, manifolds);
  if (!advance_lone_spring(scene, dt_s, ids, joints, states, report, faults)) return false;
  ++counters.joint_rows;
  return true;
}

// To the scene's tolerance, if joints alone hold the island, are closed, and few parts are enough.
bool advance_within_tolerance(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                              std::span<const BodyId> ids,
                              std::span<const ContactManifold> manifolds,
                              std::span<BodyState> states, IslandReport& report,
                              StageCounters& counters, std::vector<AdvanceFault>& faults) {
  if (!(scene.tolerance > 0.0) || scene.joints.empty()) return false;
  for (const ContactManifold& m : manifolds)
    if (!is_joint(m)) return false;
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (joints.empty() || !are_closed(scene, dt_s, states, joints)) return false;
  report = report_of(ids, manifolds);
  if (!advance_linkage_within(scene.tolerance * (dt_s / scene.dt_s), sizes_of(scene, geometry, ids),
                              scene, dt_s, ids, joints, states, report, faults))
    return false;
  count_linked(scene, ids, joints, report, counters);
  return true;
}

}  // namespace

IslandReport advance_resting(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds,
                             std::span<BodyState> states, SolveScratch& scratch,
                             StageCounters& counters, std::vector<AdvanceFault>& faults) {
  IslandReport report;
  if (advance_exactly(scene, dt_s, ids, manifolds, states, report, counters, faults)) return report;
  if (advance_within_tolerance(scene, geometry, dt_s, ids, manifolds, states, report, counters,
                               faults))
    return report;
  return is_refined(scene, geometry, ids, manifolds)
             ? advance_refined(scene, geometry, dt_s, ids, manifolds, states, scratch, counters,
                               faults)
             : advance_unrefined(scene, geometry, dt_s, ids, manifolds, states, scratch, counters,
                                 faults);
}

namespace {

// The rest of a step of which the island has flown `flown_s`.
void advance_rest(const SceneDescription& scene, const Geometry& geometry, double flown_s,
                  std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                  std::span<BodyState> states, IslandReport& report, SolveScratch& scratch,
                  StageCounters& counters, std::vector<AdvanceFault>& faults) {
  const bool whole = !is_giant(manifolds);
  const double rest_s = scene.dt_s - flown_s;
  std::vector<BodyState> start;
  if (whole && !scene.statics.empty()) {
    start.reserve(states.size());
    for (const BodyState& state : states) start.push_back(motion_of(state));
  }
  std::vector<ContactManifold> left;
  // Impacts have brought bodies to others, and to statics, than those that the step began with.
  if (flown_s > 0.0)
    find_again(scene, geometry, rest_s, ids,
               pairs_to_look_at(scene, geometry, rest_s, ids, states, counters), states, counters,
               left);
  const std::span<const ContactManifold> met = flown_s > 0.0 ? left : manifolds;
  const bool linked = whole && is_linked(met);
  // What flight has left has been through its impacts.
  std::optional<AmongHits> among;
  if (whole && !linked && flown_s == 0.0)
    among =
        advance_among_hits(scene, geometry, rest_s, ids, met, states, scratch, counters, faults);
  const IslandReport part =
      among ? among->report
      : linked
          ? advance_linked(scene, geometry, rest_s, ids, met, states, scratch, counters, faults)
          : advance_resting(scene, geometry, rest_s, ids, met, states, scratch, counters, faults);
  if (flown_s > 0.0)
    add_part(part, report);
  else
    report = part;
  if (start.empty()) return;
  if (!linked && !(among && among->hit))
    stop_at_unseen_statics(scene, geometry, rest_s, ids, met, start, states, report, counters);
  stop_at_floors(scene, geometry, ids, start, states, report);
}

}  // namespace

IslandReport advance_island(const SceneDescription& scene, const Geometry& geometry,
                            std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                            std::span<BodyState> states, SolveScratch& scratch,
                            StageCounters& counters, std::vector<AdvanceFault>& faults) {
  const double dt_s = scene.dt_s;
  IslandReport report = report_of(ids, manifolds);
  if (!scene.solver.contact_response) {
    pass_through(scene, dt_s, ids, manifolds, states, report, counters, faults);
    return report;
  }
  // Giant ones may be solved by several worlds, of which none has them all.
  const bool whole = !is_giant(manifolds), alone = whole && is_left_alone(scene, ids, manifolds);
  const IslandMomentum before = alone ? momentum_of(scene, ids, states) : IslandMomentum{};
  std::vector<BodyState> slow;
  if (is_nearly_at_rest(scene, geometry, ids, manifolds, states)) {
    if (is_held(scene, geometry, ids, manifolds, states, report, counters)) {
      ++counters.islands_at_rest;
      return report;
    }
    slow.assign(states.begin(), states.end());
  }
  if (!scene.joints.empty()) report_lost_joints(scene, ids, manifolds, faults);
  bound_ways(scene, dt_s, ids, manifolds, states, scratch.ways);
  double flown_s = 0.0;
  if (!whole && is_one_solve(scene, geometry, ids, manifolds, states)) {
    report = advance_once(scene, dt_s, false, ids, manifolds, states, scratch, counters, faults);
  } else {
    flown_s = fly_through_impacts(scene, geometry, dt_s, ids, manifolds, states, report, counters);
    if (flown_s < dt_s)
      advance_rest(scene, geometry, flown_s, ids, manifolds, states, report, scratch, counters,
                   faults);
  }
  if (flown_s < dt_s && alone && has_met_no_static(report)) {
    keep_momentum(scene, dt_s, ids, before, states);
    report.push_out_work_joule = 0.0;
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    report_impossible_way(scene, dt_s, scratch.ways, i, ids[i], states[i], faults);
  if (!slow.empty() && (whole || report.direct))
    come_to_rest(scene, geometry, ids, slow, states, report);
  ++counters.islands_solved;
  counters.direct_islands += report.direct;
  return report;
}

void advance_free_body(const SceneDescription& scene, double dt_s, BodyId id, BodyState& state,
                       StageCounters& counters, std::vector<AdvanceFault>& faults) {
  ++counters.free_bodies_advanced;
  if (scene.bodies[index_of(id)].joints > 0) report_lost_joints(scene, {&id, 1}, {}, faults);
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
