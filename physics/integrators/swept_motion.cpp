#include "physics/integrators/swept_motion.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "physics/constraints/carried_rows.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/constraints/joint_impulses.hpp"
#include "physics/constraints/joint_loads.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/joint_work.hpp"
#include "physics/solvers/substeps.hpp"
#include "physics/solvers/swept_joints.hpp"
#include "physics/solvers/unconstrained_reference.hpp"

namespace soda::physics {
namespace {

// A contact of a long chain meets one link of it at a time.
int iterations_of(const ContactProblem& problem) {
  constexpr int kOfJoints = 2, kBesideContacts = 6;
  return problem.normals.empty() ? kOfJoints : kBesideContacts;
}

// Joints have the last word. Returns how many it made: fewer where iterations diverge.
std::uint32_t iterate_substeps(std::uint32_t count, Substeps& substeps, SweptJoints& joints,
                               ContactProblem& problem) {
  const int iterations = iterations_of(problem);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i > 0) go_on(problem, substeps);
    carry(i * substeps.length_s, substeps.length_s, problem);
    follow_poses(i == 0, joints, problem.bodies);
    for (int iteration = 0; iteration < iterations; ++iteration) {
      press(problem, substeps);
      press(joints, problem.bodies);
    }
    move_on(problem, substeps);
    move_on(problem.bodies, joints);
    relax(problem, substeps);
    relax(joints, problem.bodies);
    count_impulses(problem.bodies, joints);
    if (is_out_of_bounds(problem)) return i + 1;
  }
  return count;
}

// Where something bounces: its rebounds, and what joints make of them.
void rebound(std::uint32_t count, SweptJoints& joints, ContactProblem& problem) {
  if (problem.restitution_rows == 0 || !set_restitution_targets(problem)) return;
  for (std::uint32_t i = 0; i < count; ++i) {
    iterate_velocities(i % 2 == 0, problem);
    relax(joints, problem.bodies);
  }
  count_impulses(problem.bodies, joints);
}

// The angular velocity with which a body that turned on its way has the angular momentum that its
// rows gave it.
Vec3 angular_velocity_at_end(const BodyParams& params, const SolverBody& body,
                             const Quat& orientation) {
  if (is_isotropic(params.inertia_local_kg_m2)) return body.angular;
  const Mat3 turned_inverse =
      rotated_tensor(orientation.toRotationMatrix(), params.inverse_inertia_local);
  return times(turned_inverse, times(inverse_of_symmetric(body.inverse_inertia), body.angular));
}

// Bodies on which nothing acted fly.
void move_swept(const IslandStep& island, const ContactProblem& problem, const SweptJoints& joints,
                std::span<BodyState> states, std::vector<AdvanceFault>& faults) {
  Flights flights = find_flights(problem);
  for (const SweptPoint& point : joints.points)
    flights[point.a].supported = flights[point.b].supported = true;
  for (const JointRow& of : joints.rest.rows) {
    flights[of.a].supported = flights[of.b].supported = true;
  }
  for (std::size_t i = 0; i < states.size(); ++i) {
    const BodyParams& params = island.scene.bodies[index_of(island.ids[i])];
    const SolverBody& body = problem.bodies[i];
    if (!flights[i].supported || params.kinematic) {
      move_body({island.scene, island.dt_s, island.ids[i], body, flights[i], nullptr}, states[i],
                faults);
      continue;
    }
    BodyState next = joints.poses[i];
    next.linear_velocity_m_s = body.linear;
    next.angular_velocity_rad_s = angular_velocity_at_end(params, body, next.orientation);
    const char* const fault = fault_of(next);
    if (*fault) {
      faults.push_back({island.ids[i], fault});
      continue;
    }
    next.impulses = std::move(states[i].impulses);
    next.broken_joints = std::move(states[i].broken_joints);
    states[i] = std::move(next);
  }
}

// What no law of contact or joint gives: closing and parting, beyond the final velocities.
double parting_joule(const JointedStep& step, const ContactProblem& problem,
                     const Substeps& substeps) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  const FastestCorrection most = fastest_correction(scene, ids);
  std::vector<PositionCorrection> push(ids.size());
  const Flight moves{true, Vec3::Zero()};
  for (std::size_t i = 0; i < ids.size(); ++i)
    push[i] = beyond_final_velocity(dt_s, most, step.states[i], problem.bodies[i], moves,
                                    substeps.displacements[i]);
  return push_out_work_joule(scene, dt_s, ids, push);
}

// What no velocity was left for. A motor that brakes what rests has taken nothing.
void add_untaken(double rest_joule, IslandReport& report) {
  const double braked = std::min(rest_joule, std::max(0.0, -report.motor_work_joule));
  report.motor_work_joule += braked;
  report.push_out_work_joule += rest_joule - braked;
}

// Whether iterations have made more energy than closing and parting can: they diverge where levers
// are very long and inertia is very small.
bool has_diverged(const IslandStep& island, const EnergyExcess& excess) {
  constexpr double kMostTaken = 0.5;  // of the energy of motion
  const double lifting_joule = weight_newton(island.scene, island.ids) *
                               fastest_correction(island.scene, island.ids).m_s * island.dt_s;
  return !excess.is_trace(kMostTaken) && !(excess.gain_joule <= lifting_joule);
}

// A step that was swept.
struct SweptStep {
  const JointedStep& step;
  const JointSystem& joints;
  const ContactProblem& problem;
  const SweptJoints& swept;
  const Substeps& substeps;
};

// What the step has given, and takes energy that it must not: the report gets it. `unsprung_joule`
// springs gave. False, and no change, if the energy is out of all proportion.
bool account(const SweptStep& done, double unsprung_joule, std::span<BodyState> states,
             IslandReport& report) {
  const auto& [step, joints, problem, swept, substeps] = done;
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  const double parted = std::max(0.0, parting_joule(step, problem, substeps));
  const double given = swept.motor_work_joule + kinematic_work_joule(step.free, problem) +
                       external_work_joule(scene, dt_s, ids, step.states, step.free, problem) +
                       unsprung_joule + parted;
  const EnergyExcess excess = energy_excess(scene, dt_s, ids, step.states, states, given);
  if (has_diverged(step.island, excess)) return false;
  report.motor_work_joule = swept.motor_work_joule;
  report.static_impulse_newton_s += swept.by_world_newton_s;
  report.static_angular_impulse_newton_m_s += swept.by_world_newton_m_s;
  report.push_out_work_joule += parted;
  add_loads(joints, report);
  report.joint_error = largest_error(joints);
  report.constraint_residual_m_s = residual_m_s(swept, problem.bodies);
  if (!(excess.gain_joule > 0.0)) return true;
  const bool isolated = is_isolated(ids.size(), joints, &problem);
  add_untaken(take_excess(scene, ids, excess, isolated, states, report), report);
  return true;
}

// The island in so many substeps, or in as many as the growth of its overlaps asks for, and where
// it diverges in the most. A part of a step has its share of what they may grow by. Returns the
// number of all substeps made.
std::uint32_t sweep(const JointedStep& step, std::uint32_t count, const SweptRows& rows,
                    Substeps& substeps, std::optional<SweptJoints>& swept) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  ContactProblem& problem = rows.problem;
  const double most_growth = kMostGrowth * dt_s / scene.dt_s;
  const std::uint32_t most = kMostTimesSubsteps * count;
  const ContactProblem start = problem;
  for (std::uint32_t done = 0;;) {
    begin_substeps(dt_s, count, IndexedSpan<BodyState>{step.states}, problem, substeps);
    swept.emplace(swept_joints(scene, substeps.length_s, count, step.states, rows.joints));
    const std::uint32_t made = iterate_substeps(count, substeps, *swept, problem);
    done += made;
    count = made < count ? most : next_count(problem, substeps, most_growth, most);
    if (count == substeps.count) return done;
    problem = start;
  }
}

}  // namespace

std::optional<std::uint32_t> advance_swept(const JointedStep& step, std::uint32_t count,
                                           const SweptRows& rows, std::span<BodyState> states,
                                           IslandReport& report) {
  auto& [joints, problem] = rows;
  const auto& [island, before, free] = step;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  build_joint_rows(scene, dt_s, before, true, joints);
  if (scene.solver.warm_starting) load_joint_impulses(scene, before, joints);
  const double lent = elastic_joule(scene, joints, before);
  Substeps substeps;
  std::optional<SweptJoints> made;
  const std::uint32_t done = sweep(step, count, rows, substeps, made);
  SweptJoints& swept = *made;
  end_substeps(problem, substeps);
  carry(0.0, dt_s, problem);
  rebound(count, swept, problem);
  std::vector<AdvanceFault> faults;
  move_swept(island, problem, swept, states, faults);
  end_substeps(swept, joints);
  if (!faults.empty() || !account({step, joints, problem, swept, substeps},
                                  lent - elastic_joule(scene, joints, states), states, report)) {
    std::copy(before.begin(), before.end(), states.begin());
    return std::nullopt;
  }
  return (static_cast<std::uint32_t>(iterations_of(problem)) + 1) * done;
}

}  // namespace soda::physics
