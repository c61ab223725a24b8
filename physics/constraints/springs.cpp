#include "physics/constraints/springs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "physics/constraints/joint_loads.hpp"
#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {

Oscillation oscillate(double squared_rate_1_s2, double damping_1_s, double time_s) {
  const double squared = squared_rate_1_s2 - damping_1_s * damping_1_s;
  double mean = 0.0;  // of the coefficients keeps and speed
  Oscillation next;
  if (squared > 0.0) {
    const double rate = std::sqrt(squared);
    const double left = decay_over(damping_1_s, time_s).left;
    const Quat rotation = rotation_by(Vec3(2.0 * rate * time_s, 0.0, 0.0));  // by half of it
    mean = left * rotation.w();
    next.turns_s = left * rotation.x() / rate;
  } else {
    const double split = std::sqrt(-squared);
    const double slow = decay_over(squared_rate_1_s2 / (damping_1_s + split), time_s).left;
    const Decay fast = decay_over(2.0 * split, time_s);
    mean = 0.5 * slow * (1.0 + fast.left);
    next.turns_s = slow * fast.speed_s;
  }
  next.keeps = mean + damping_1_s * next.turns_s;
  next.speed = mean - damping_1_s * next.turns_s;
  return next;
}

namespace {

constexpr double kAside = 1e-12;  // of a length: rounding

// What a row's impulse does to its own velocity, 1/kg.
double give_of(const JointRow& row, std::span<const SolverBody> bodies) {
  const SolverBody &a = bodies[row.a], &b = bodies[row.b];
  return (a.inverse_mass + b.inverse_mass) * row.linear.squaredNorm() +
         row.angular_a.dot(a.inverse_inertia * row.angular_a) +
         row.angular_b.dot(b.inverse_inertia * row.angular_b);
}

Vec3 across(const Vec3& v, const Vec3& direction) { return v - direction * direction.dot(v); }

// The only spring of an island, seen as a vector from end to end.
struct SingleSpring {
  const Joint& joint;
  double give_1_kg = 0.0;
  Vec3 from_end_to_end_m = Vec3::Zero(), velocity_m_s = Vec3::Zero();
  Vec3 field_m_s2 = Vec3::Zero();  // by how much fields accelerate that
  Vec3 anchor_b_m = Vec3::Zero();
  Vec3 direction = Vec3::Zero();
};

// Whether the arm from the centre to the anchor is along the spring and stays so.
bool keeps_line(const BodyState& state, const Vec3& arm, const Vec3& direction) {
  if (arm == Vec3::Zero()) return true;
  return state.angular_velocity_rad_s == Vec3::Zero() &&
         across(arm, direction).norm() <= kAside * arm.norm();
}

SingleSpring single_spring(const SceneDescription& scene, const Joint& joint,
                           std::span<const BodyState> states) {
  SingleSpring spring{joint};
  const BodyState& a = states[0];
  const bool with_world = states.size() == 1;
  spring.give_1_kg = 1.0 / scene.bodies[index_of(joint.a)].mass_kg;
  spring.anchor_b_m = joint.anchor_b_m;
  spring.velocity_m_s = -a.linear_velocity_m_s;
  spring.field_m_s2 = -field_of(scene, joint.a);
  if (!with_world) {
    const BodyState& b = states[1];
    spring.give_1_kg += 1.0 / scene.bodies[index_of(joint.b)].mass_kg;
    spring.anchor_b_m = b.position_m + b.orientation * joint.anchor_b_m;
    spring.velocity_m_s += b.linear_velocity_m_s;
    spring.field_m_s2 += field_of(scene, joint.b);
  }
  spring.from_end_to_end_m = spring.anchor_b_m - (a.position_m + a.orientation * joint.anchor_a_m);
  const double length = spring.from_end_to_end_m.norm();
  if (length > 0.0) spring.direction = spring.from_end_to_end_m / length;
  return spring;
}

bool is_linear(const SingleSpring& spring, std::span<const BodyState> states) {
  const Joint& joint = spring.joint;
  const Vec3& n = spring.direction;
  if (joint.length_m == 0.0 && joint.damping_newton_s_m == 0.0)
    return joint.anchor_a_m == Vec3::Zero() &&
           (states.size() == 1 || joint.anchor_b_m == Vec3::Zero());
  if (n == Vec3::Zero()) return false;
  if (!keeps_line(states[0], states[0].orientation * joint.anchor_a_m, n)) return false;
  if (states.size() > 1 && !keeps_line(states[1], states[1].orientation * joint.anchor_b_m, n))
    return false;
  const double squared_rate = joint.stiffness_newton_m * spring.give_1_kg;
  const double rate = std::sqrt(squared_rate), length = spring.from_end_to_end_m.norm();
  const double field = spring.field_m_s2.norm();
  if (across(spring.velocity_m_s, n).norm() > kAside * rate * length) return false;
  if (across(spring.field_m_s2, n).norm() > kAside * field) return false;
  // An end comes no farther from where it would rest than its energy lets it.
  const double rest = joint.length_m + spring.field_m_s2.dot(n) / squared_rate;
  const double off = length - rest, speed = spring.velocity_m_s.norm() / rate;
  return std::sqrt(off * off + speed * speed) < rest;
}

}  // namespace

bool advance_single_spring(const SceneDescription& scene, double dt_s, const JointSystem& joints,
                           std::span<BodyState> states, IslandReport& report,
                           std::vector<AdvanceFault>& faults) {
  if (joints.joints.size() != 1) return false;
  const Joint& joint = scene.joints[joints.joints.front()];
  if (joint.kind != JointKind::kSpring || states.size() != (is_static(joint.b) ? 1 : 2))
    return false;
  const std::array both{joint.a, joint.b};
  const std::span<const BodyId> ids = std::span(both).first(states.size());
  for (const BodyId id : ids)
    if (is_pushed(scene.bodies[index_of(id)])) return false;
  const SingleSpring spring = single_spring(scene, joint, states);
  if (!is_linear(spring, states)) return false;

  const double squared_rate = joint.stiffness_newton_m * spring.give_1_kg;
  const Oscillation next =
      oscillate(squared_rate, 0.5 * joint.damping_newton_s_m * spring.give_1_kg, dt_s);
  const Vec3 rest = spring.direction * joint.length_m + spring.field_m_s2 * (1.0 / squared_rate);
  const Vec3 off = spring.from_end_to_end_m - rest, &speed = spring.velocity_m_s;
  const Vec3 off_then = off * next.keeps + speed * next.turns_s;
  const Vec3 speed_then = speed * next.speed - off * (squared_rate * next.turns_s);
  // Of what fields and velocities alone would do, over the give: impulse and its displacement.
  const Vec3 impulse = (speed_then - speed - spring.field_m_s2 * dt_s) * (1.0 / spring.give_1_kg);
  const Vec3 displacement =
      (off_then - off - speed * dt_s - spring.field_m_s2 * (0.5 * dt_s * dt_s)) *
      (1.0 / spring.give_1_kg);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    const double share = (i == 0 ? -1.0 : 1.0) / params.mass_kg;
    const Vec3 field = field_of(scene, params);
    BodyState moved;
    moved.broken_joints = states[i].broken_joints;
    moved.orientation = states[i].orientation;
    moved.angular_velocity_rad_s = states[i].angular_velocity_rad_s;
    moved.position_m = states[i].position_m + states[i].linear_velocity_m_s * dt_s +
                       field * (0.5 * dt_s * dt_s) + displacement * share;
    moved.linear_velocity_m_s = states[i].linear_velocity_m_s + field * dt_s + impulse * share;
    rotate_freely(params, dt_s, moved);
    const char* fault = fault_of(moved);
    if (*fault)
      faults.push_back({ids[i], fault});
    else
      states[i] = std::move(moved);
  }
  if (can_break(joint)) add_load({joints.joints.front(), impulse}, report);
  if (ids.size() > 1) return true;
  report.static_impulse_newton_s -= impulse;
  report.static_angular_impulse_newton_m_s -= spring.anchor_b_m.cross(impulse);
  return true;
}

SpringRates rates_of(std::span<const SpringRow> springs, std::span<const SolverBody> bodies) {
  // Of each body, all springs at it; a spring swings no faster than both of its ends together.
  std::vector<double> stiffness(bodies.size(), 0.0), damping(bodies.size(), 0.0);
  const auto add = [&](std::uint32_t body, const Vec3& angular, const SpringRow& spring) {
    const double inverse_mass = bodies[body].inverse_mass;
    const double give = inverse_mass + angular.dot(bodies[body].inverse_inertia * angular);
    // The pull swings the body about the far end, and turns it into its own line.
    const double pull = spring.stiffness_newton_m * std::abs(spring.row.error);
    const double turns =
        pull * spring.arm_m[body == spring.row.b] * bodies[body].inverse_inertia.norm();
    stiffness[body] += spring.stiffness_newton_m * give + turns;
    if (pull > 0.0) stiffness[body] += pull * give / spring.length_m;
    damping[body] += spring.damping_newton_s_m * give;
  };
  for (const SpringRow& spring : springs) {
    add(spring.row.a, spring.row.angular_a, spring);
    add(spring.row.b, spring.row.angular_b, spring);
  }
  SpringRates most;
  for (const SpringRow& spring : springs) {
    const std::uint32_t a = spring.row.a, b = spring.row.b;
    most.swing_rad_s = std::max(most.swing_rad_s, std::sqrt(stiffness[a] + stiffness[b]));
    most.damping_1_s = std::max(most.damping_1_s, damping[a] + damping[b]);
  }
  return most;
}

double parts_for(const SpringRates& rates, double dt_s) {
  constexpr double kMostSwing_rad = 0.25, kMostDamping = 0.25;
  return dt_s * std::max(rates.swing_rad_s / kMostSwing_rad, rates.damping_1_s / kMostDamping);
}

void apply_spring_impulses(std::span<const SpringRow> springs, double time_s, bool backwards,
                           std::span<const BodyState> states, std::span<SolverBody> bodies,
                           IslandReport& report) {
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const SpringRow& spring = springs[backwards ? springs.size() - 1 - i : i];
    const JointRow& row = spring.row;
    const double damped = spring.damping_newton_s_m * time_s;
    const double impulse =
        -(spring.stiffness_newton_m * time_s * row.error + damped * velocity_of(row, bodies)) /
        (1.0 + 0.5 * damped * give_of(row, bodies));
    apply_joint_impulse(row, impulse, bodies);
    if (spring.can_break) add_load({spring.joint, row.linear * impulse}, report);
    if (row.b != states.size()) continue;
    const Vec3 given = row.linear * -impulse;
    report.static_impulse_newton_s += given;
    report.static_angular_impulse_newton_m_s +=
        states[row.a].position_m.cross(given) - row.angular_a * impulse;
  }
}

double elastic_joule(std::span<const SpringRow> springs) {
  double sum = 0.0;
  for (const SpringRow& spring : springs)
    sum += 0.5 * spring.stiffness_newton_m * spring.row.error * spring.row.error;
  return sum;
}

double elastic_joule(const SceneDescription& scene, const JointSystem& joints,
                     std::span<const BodyState> states) {
  return has_springs(scene, joints) ? elastic_joule(spring_rows(scene, states, joints)) : 0.0;
}

}  // namespace soda::physics
