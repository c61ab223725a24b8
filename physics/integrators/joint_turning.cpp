#include "physics/integrators/joint_turning.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

// What a row has more of at the start than at the end.
JointRow turned_back(const JointRow& start, const JointRow& end) {
  JointRow row = end;
  row.linear = start.linear - end.linear;
  row.angular_a = start.angular_a - end.angular_a;
  row.angular_b = start.angular_b - end.angular_b;
  return row;
}

// By how much the velocity of each body changes, what joints have taken, and what of the change the
// world gives.
struct Turning {
  std::vector<SolverBody> given;
  double taken_joule = 0.0;  // of springs, which take and give, by turning alone
  Vec3 by_world_newton_s = Vec3::Zero(), by_world_newton_m_s = Vec3::Zero();
};

std::vector<SolverBody> at_rest(std::span<const SolverBody> bodies) {
  std::vector<SolverBody> rest(bodies.begin(), bodies.end());
  for (SolverBody& body : rest) body.linear = body.angular = Vec3::Zero();
  return rest;
}

double energy_joule(const SolverBody& body) {
  const Mat3 inertia = inverse_of_symmetric(body.inverse_inertia);
  return 0.5 *
         (body.linear.squaredNorm() / body.inverse_mass + body.angular.dot(inertia * body.angular));
}

// Of each body, how much of a change it takes: all, where that is little beside its velocity, and
// where it is more than that, little. Next to each other are the square of its frequency times dt,
// where it swings, and 1.
std::vector<double> shares_of(std::span<const SolverBody> bodies,
                              std::span<const SolverBody> changes) {
  std::vector<double> shares(bodies.size(), 1.0);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].inverse_mass == 0.0) continue;  // kinematic, and the world
    const double moving = energy_joule(bodies[i]), change = energy_joule(changes[i]);
    if (change > 0.0) shares[i] = moving / (moving + change);
  }
  return shares;
}

// What the rows that are not bounded have more of at the start than at the end, with the impulses
// that were found.
std::vector<JointRow> turned_rows(const JointedStep& step, const JointedSolution& solved) {
  std::vector<JointRow> turned;
  JointSystem start = solved.joints;
  build_joint_rows(step.island.scene, step.island.dt_s, step.states, true, start);
  for (std::size_t r = 0; r < start.rows.size(); ++r) {
    const JointRow& row = solved.joints.rows[r];
    if (!is_bounded(row) && row.impulse_newton_s != 0.0)
      turned.push_back(turned_back(start.rows[r], row));
  }
  return turned;
}

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

Turning turning_of(const JointedStep& step, const JointedSolution& solved) {
  const std::span<const SolverBody> bodies = solved.problem.bodies;
  const std::vector<JointRow> turned = turned_rows(step, solved);
  Turning turning{at_rest(bodies), taken_joule(step, solved, turned)};
  for (const JointRow& row : turned) apply_joint_impulse(row, row.impulse_newton_s, turning.given);
  const std::vector<double> shares = shares_of(bodies, turning.given);
  turning.given = at_rest(bodies);
  for (const JointRow& row : turned) {
    const double impulse = std::min(shares[row.a], shares[row.b]) * row.impulse_newton_s;
    apply_joint_impulse(row, impulse, turning.given);
    if (row.b != step.states.size()) continue;
    turning.by_world_newton_s -= row.linear * impulse;
    turning.by_world_newton_m_s -=
        row.angular_a * impulse + step.states[row.a].position_m.cross(row.linear * impulse);
  }
  return turning;
}

void add(double share, std::span<const SolverBody> given, std::span<BodyState> states) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (given[i].inverse_mass == 0.0) continue;  // kinematic: it goes where it is told
    states[i].linear_velocity_m_s += share * given[i].linear;
    states[i].angular_velocity_rad_s += share * given[i].angular;
  }
}

// The largest share of a change at which it gives no more than `most` > 0: it gives b s + a s^2.
double most_share(double half, double all, double most) {
  if (all <= most) return 1.0;
  const double a = 2.0 * all - 4.0 * half, b = all - a;
  return 2.0 * most / (b + std::sqrt(std::max(0.0, b * b + 4.0 * a * most)));
}

}  // namespace

void give_back_turning(const JointedStep& step, const JointedSolution& solved, double most_joule,
                       std::span<BodyState> states, IslandReport& report) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step.island;
  const Turning turning = turning_of(step, solved);
  const double most = std::min(most_joule, turning.taken_joule);
  if (!(most > 0.0)) return;
  const double none = kinetic_joule(scene, ids, states);
  std::vector<BodyState> with(states.begin(), states.end());
  add(0.5, turning.given, with);
  const double half = kinetic_joule(scene, ids, with) - none;
  add(0.5, turning.given, with);
  const double share = most_share(half, kinetic_joule(scene, ids, with) - none, most);
  if (!(share > 0.0 && share <= 1.0)) return;
  add(share, turning.given, states);
  report.static_impulse_newton_s += share * turning.by_world_newton_s;
  report.static_angular_impulse_newton_m_s += share * turning.by_world_newton_m_s;
}

}  // namespace soda::physics
