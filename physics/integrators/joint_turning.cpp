#include "physics/integrators/joint_turning.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/joint_stiffness.hpp"

namespace soda::physics {
namespace {

// What of a pull meets external forces. Between bodies that are held joints have no one solution.
double part_of(double pull, double meets) {
  return std::clamp(meets, std::min(pull, 0.0), std::max(pull, 0.0));
}

// Of rows that are not bounded: what they have more of at the start than at the end, with the
// impulses that were found; half of what meets external forces.
std::vector<JointRow> turned_rows(std::span<const JointRow> end, const HalfWay& half_way) {
  std::vector<JointRow> turned;
  for (std::size_t r = 0; r < end.size(); ++r) {
    if (is_bounded(end[r]) || end[r].impulse_newton_s == 0.0) continue;
    const JointRow& middle = half_way.rows.rows[r];
    JointRow& row = turned.emplace_back(end[r]);
    const double meets = half_way.kicks.joints.rows[r].impulse_newton_s;
    row.impulse_newton_s -= 0.5 * part_of(row.impulse_newton_s, meets);
    row.linear = 2.0 * (middle.linear - end[r].linear);
    row.angular_a = 2.0 * (middle.angular_a - end[r].angular_a);
    row.angular_b = 2.0 * (middle.angular_b - end[r].angular_b);
  }
  return turned;
}

// By joints that hold; by springs, which take and give, by turning alone.
double taken_joule(const JointedStep& step, const JointedSolution& solved,
                   std::span<const JointRow> turned) {
  const std::span<const SolverBody> bodies = solved.problem.bodies;
  std::vector<SolverBody> middle(bodies.begin(), bodies.end());
  for (std::size_t i = 0; i < step.free.size(); ++i) {
    middle[i].linear = 0.5 * (middle[i].linear + step.free[i].linear);
    middle[i].angular = 0.5 * (middle[i].angular + step.free[i].angular);
  }
  double sum = 0.0;
  for (const JointRow& row : solved.joints.rows)
    if (row.kind == JointRowKind::kHolds) sum -= row.impulse_newton_s * velocity_of(row, middle);
  for (const JointRow& row : turned)
    if (row.kind == JointRowKind::kSpring) sum += row.impulse_newton_s * velocity_of(row, middle);
  return sum;
}

double energy_joule(const SolverBody& body) {
  const Mat3 inertia = inverse_of_symmetric(body.inverse_inertia);
  return 0.5 *
         (body.linear.squaredNorm() / body.inverse_mass + body.angular.dot(inertia * body.angular));
}

// How much of a change of velocities is no answer of what is stiff: all, where no body changes by
// much of its velocity. Of what swings, the square of its frequency times dt stands beside 1. A
// body that is slow beside the island counts as a tenth as fast as that, for what is held does not
// swing.
double smooth_share(std::span<const SolverBody> bodies, std::span<const SolverBody> changes) {
  constexpr double kSlow = 0.01;  // of energy
  double sum_joule = 0.0, sum_kg = 0.0;
  for (const SolverBody& body : bodies) {
    if (body.inverse_mass == 0.0) continue;  // kinematic, and the world
    sum_joule += energy_joule(body);
    sum_kg += 1.0 / body.inverse_mass;
  }
  double least = 1.0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].inverse_mass == 0.0) continue;
    const double slow_joule = kSlow * sum_joule / (sum_kg * bodies[i].inverse_mass);
    const double moving = energy_joule(bodies[i]) + slow_joule, change = energy_joule(changes[i]);
    if (change > 0.0) least = std::min(least, moving / (moving + change));
  }
  return least;
}

void add(double share, std::span<const SolverBody> changes, std::span<BodyState> states) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (changes[i].inverse_mass == 0.0) continue;  // kinematic: it goes where it is told
    states[i].linear_velocity_m_s += share * changes[i].linear;
    states[i].angular_velocity_rad_s += share * changes[i].angular;
  }
}

// Lines resist what turns as one, too: by k of it, their stiffness over that of the masses, small
// as it is; the square of k is left.
void spare_smooth_turning(std::span<const SolverBody> bodies, std::span<JointRow> rows) {
  for (JointRow& row : rows) {
    const double response = bodies[row.a].inverse_mass + bodies[row.b].inverse_mass;
    if (row.kind != JointRowKind::kStiffness || !(response > 0.0)) continue;
    row.softness_1_kg += row.softness_1_kg * row.softness_1_kg / response;
  }
}

// The largest share, up to 1, of changes that gives no more than `most` > 0: b s + a s^2.
double affordable_share(const JointedStep& step, std::span<const SolverBody> changes, double most,
                        std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  const double none = kinetic_joule(scene, ids, states);
  std::vector<BodyState> with(states.begin(), states.end());
  add(0.5, changes, with);
  const double half = kinetic_joule(scene, ids, with) - none;
  add(0.5, changes, with);
  const double all = kinetic_joule(scene, ids, with) - none;
  if (all <= most) return 1.0;
  const double a = 2.0 * all - 4.0 * half, b = all - a;
  return 2.0 * most / (b + std::sqrt(std::max(0.0, b * b + 4.0 * a * most)));
}

// What the world gives by a share of the impulses of rows.
void report_by_world(double share, std::span<const JointRow> rows,
                     std::span<const BodyState> states, IslandReport& report) {
  for (const JointRow& row : rows) {
    if (row.b != states.size()) continue;
    const double impulse = share * row.impulse_newton_s;
    report.static_impulse_newton_s -= row.linear * impulse;
    report.static_angular_impulse_newton_m_s -=
        row.angular_a * impulse + states[row.a].position_m.cross(row.linear * impulse);
  }
}

}  // namespace

void give_back_turning(const JointedStep& step, const JointedSolution& solved,
                       const HalfWay& half_way, double most_joule, std::span<BodyState> states,
                       IslandReport& report) {
  const std::span<const SolverBody> bodies = solved.problem.bodies;
  const std::vector<JointRow> turned = turned_rows(solved.joints.rows, half_way);
  const double most = std::min(most_joule, taken_joule(step, solved, turned));
  if (!(most > 0.0)) return;
  std::vector<SolverBody> changes(bodies.begin(), bodies.end());
  for (SolverBody& body : changes) body.linear = body.angular = Vec3::Zero();
  const std::vector<SolverBody> rest = changes;
  const auto all = std::span(rest).first(states.size());
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  JointSystem rows = half_way.rows;
  if (are_even(scene, ids)) {
    add_stiffness_rows(scene, dt_s, states, solved.joints, rest, rows);
    spare_smooth_turning(bodies, rows.rows);
  }
  stiffen(scene, dt_s, states, solved.joints, all, changes);
  for (const JointRow& row : turned) apply_joint_impulse(row, row.impulse_newton_s, changes);
  // A light body between others would have all that its pulls would give it.
  stop_joint_velocities(changes, rows);
  unstiffen(all, changes);
  const double affordable = affordable_share(step, changes, most, states);
  if (!(affordable > 0.0)) return;  // nor where it is no number
  const double share = std::min(affordable, smooth_share(bodies, changes));
  add(share, changes, states);
  report_by_world(share, turned, step.states, report);
  report_by_world(share, rows.rows, step.states, report);
}

}  // namespace soda::physics
