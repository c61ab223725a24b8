// Moves the bodies of a solved island with joints, and closes and accounts for what that opens.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/integrators/giving_way.hpp"
#include "physics/integrators/joint_closing.hpp"
#include "physics/integrators/joint_kicks.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/joint_turning.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/joint_work.hpp"

namespace soda::physics {
namespace {

// The bodies at their final velocities for a part of the step, joints closed, and what lies on them
// out of their way.
GivenWay moved_for(double time_s, const JointedStep& step, const JointedSolution& solved,
                   std::span<BodyState> states, std::vector<AdvanceFault>& faults) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  Flights flights = find_flights(solved.problem);
  for (const JointRow& row : solved.joints.rows)
    flights[row.a].supported = flights[row.b].supported = true;
  for (std::size_t i = 0; i < ids.size(); ++i)
    move_body({scene, time_s, ids[i], solved.problem.bodies[i], flights[i], nullptr}, states[i],
              faults);
  JointSystem joints = solved.joints;
  const std::vector<BodyState> open(states.begin(), states.end());
  close_joints(scene, dt_s, ids, kinetic_joule(scene, ids, states), joints, states);
  return give_way(step.island, {time_s, step.states, open}, joints, solved.problem, states);
}

// Position correction; then joints are closed once more, and what lies on them gives way. All of
// that lifts no more than position correction may.
void push_apart(const JointedStep& step, const JointedSolution& solved, std::span<BodyState> states,
                IslandReport& report) {
  const auto& [island, before, free] = step;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [joints, problem, push, compared] = solved;
  const double moved = elastic_joule(scene, joints, states);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    states[i].position_m += push[i].linear * dt_s;
    rotate_by(scene.bodies[index_of(ids[i])], push[i].angular * dt_s, states[i]);
  }
  JointSystem closed = joints;
  const double lifted = push_out_work_joule(scene, dt_s, ids, push);
  report.push_out_work_joule += lifted;
  const std::vector<BodyState> open(states.begin(), states.end());
  double fastest_m_s = 0.0;
  for (const PositionCorrection& body : push)
    fastest_m_s = std::max(fastest_m_s, body.linear.norm());
  const double weight_dt = weight_newton(scene, ids) * dt_s;
  double left =
      std::max(0.0, weight_dt * fastest_correction(scene, ids).m_s - std::max(0.0, lifted));
  const double closing =
      close_joints(scene, dt_s, ids, std::min(left, weight_dt * fastest_m_s), closed, states);
  left = std::max(0.0, left - std::max(0.0, closing));
  report.push_out_work_joule +=
      closing + give_way(island, {0.0, before, open, left}, closed, problem, states).work_joule;
  report.push_out_work_joule += elastic_joule(scene, joints, states) - moved;
}

// What no velocity was left for. A motor that brakes what rests has taken nothing. The rest is
// closing: of what was open before, if the bodies have not moved; else at most what places that
// hold to rounding lift what hangs on them. `most_lift_m`: of which of both.
void add_untaken(double rest_joule, double most_lift_m, const JointedStep& step,
                 IslandReport& report) {
  constexpr double kRounding = 1e-12;
  const double braked = std::max(0.0, -report.motor_work_joule);
  if (rest_joule < (1.0 - kRounding) * braked) {
    report.motor_work_joule += rest_joule;
    return;
  }
  if (braked > 0.0) report.motor_work_joule = 0.0;
  const double weight = weight_newton(step.island.scene, step.island.ids);
  const double lifted = rest_joule - braked;
  if (lifted > 0.0 && !(lifted > most_lift_m * weight)) report.push_out_work_joule += lifted;
}

// What the step's order takes of what turns and swings: all of it if joints and the world allow it.
// `work_joule` is what the bodies got, the energy of springs at the start included.
void give_back(const JointedStep& step, const JointedSolution& solved, double work_joule,
               std::span<BodyState> states, IslandReport& report) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  const auto gained = [&] {
    return energy_excess(scene, dt_s, ids, step.states, states,
                         work_joule - elastic_joule(scene, solved.joints, states));
  };
  const JointSystem middle = middle_rows(step, solved);
  const JointKicks kicks = find_kicks(step, solved, middle);
  give_back_turning(step, solved, {middle, kicks}, -gained().gain_joule, states, report);
  if (!(kicks.lift_joule > 0.0)) return;
  const std::vector<BodyState> whole(states.begin(), states.end());
  move_by_mean(step, solved, kicks, -gained().gain_joule, states);
  const EnergyExcess excess = gained();
  if (!(excess.gain_joule > 0.0)) return;
  if (excess.is_trace(1.0))
    take_excess(scene, ids, excess, false, states, report);
  else
    std::copy(whole.begin(), whole.end(), states.begin());
}

}  // namespace

void move_jointed(const JointedStep& step, const JointedSolution& solved,
                  std::span<BodyState> states, IslandReport& report,
                  std::vector<AdvanceFault>& faults) {
  constexpr double kMostTaken = 0.5;  // of the energy of motion
  constexpr double kLeastShare = 1.0 / 64;
  constexpr double kHelps = 0.9;  // of the energy at the share before
  constexpr double kRoundings = 100.0;
  const auto& [island, before, free] = step;
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [joints, problem, push, compared] = solved;
  report.motor_work_joule = motor_work_joule(joints, problem.bodies);
  const double pushed = report.motor_work_joule +
                        external_work_joule(scene, dt_s, ids, before, free, problem) +
                        kinematic_work_joule(free, problem);
  const double lent = elastic_joule(scene, joints, before);
  // Springs carry no body farther than their energy.
  DisplacementBounds bounds;
  bound_displacements(scene, dt_s, ids, manifolds, before, bounds);
  // Where the path bends so much within the step that closing what it opened takes more than there
  // is, the bodies come less far; where that does not help, as in a knot, they stay.
  std::vector<BodyState> next;
  EnergyExcess excess;
  double share = share_within(scene, bounds, ids, problem.bodies);
  GivenWay given;
  for (double before_joule = 1e300;; before_joule = excess.gain_joule) {
    next.assign(before.begin(), before.end());
    std::vector<AdvanceFault> found;
    given = moved_for(share * dt_s, step, solved, next, found);
    excess = energy_excess(scene, dt_s, ids, before, next,
                           pushed + lent - elastic_joule(scene, joints, next));
    if (excess.is_trace(kMostTaken) || !(share > 0.0)) {
      faults.insert(faults.end(), found.begin(), found.end());
      break;
    }
    const bool helps = excess.gain_joule < kHelps * before_joule;
    share = helps && share > kLeastShare ? 0.5 * share : 0.0;
  }
  std::move(next.begin(), next.end(), states.begin());
  report.static_impulse_newton_s += given.by_world_newton_s;
  report.static_angular_impulse_newton_m_s += given.by_world_newton_m_s;
  if (excess.gain_joule > 0.0) {
    const double rest =
        take_excess(scene, ids, excess, is_isolated(ids.size(), joints, &problem), states, report);
    const double aside = std::clamp(rest, 0.0, std::max(0.0, given.work_joule));
    report.push_out_work_joule += aside;
    const double most_lift_m = share > 0.0 ? kRoundings * rounding_of(before, joints.reach_m)
                                           : std::numeric_limits<double>::infinity();
    if (rest > aside) add_untaken(rest - aside, most_lift_m, step, report);
  } else if (share == 1.0 && !compared && !excess.is_rounding(excess.moving_joule)) {
    give_back(step, solved, pushed + lent, states, report);
  }
  if (!push.empty()) push_apart(step, solved, states, report);
}

}  // namespace soda::physics
