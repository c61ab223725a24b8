#include "physics/solvers/joint_work.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/solvers/unconstrained_reference.hpp"

namespace soda::physics {
namespace {

// Of energies: below it, a gain is rounding.
constexpr double kWorkRounding = 1e-13;
// Of the energy that a fall of one step has: what places that hold to rounding are off by.
constexpr double kFallPart = 1e-11;
constexpr double kEpsilon = 2.3e-16;

Mat3 inertia_of(const BodyParams& params, const BodyState& state) {
  return rotated_tensor(state.orientation.toRotationMatrix(), params.inertia_local_kg_m2);
}

struct Motion {
  double mass_kg = 0.0;
  Vec3 centre_m = Vec3::Zero(), velocity_m_s = Vec3::Zero(), angular_velocity_rad_s = Vec3::Zero();

  Vec3 velocity_at(const Vec3& place) const {
    return velocity_m_s + angular_velocity_rad_s.cross(Vec3(place - centre_m));
  }
};

// Of one rigid body with the momentum and the angular momentum of all.
Motion common_motion(const SceneDescription& scene, std::span<const BodyId> ids,
                     std::span<const BodyState> states) {
  Motion all;
  const Vec3 origin = states.front().position_m;
  Vec3 momentum = Vec3::Zero(), first_moment = Vec3::Zero();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const double mass = scene.bodies[index_of(ids[i])].mass_kg;
    all.mass_kg += mass;
    momentum += states[i].linear_velocity_m_s * mass;
    first_moment += (states[i].position_m - origin) * mass;
  }
  all.centre_m = origin + first_moment / all.mass_kg;
  all.velocity_m_s = momentum / all.mass_kg;
  Vec3 angular = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    const Mat3 own = inertia_of(params, states[i]);
    const Vec3 arm = states[i].position_m - all.centre_m;
    const Vec3 relative = states[i].linear_velocity_m_s - all.velocity_m_s;
    angular += own * states[i].angular_velocity_rad_s + params.mass_kg * arm.cross(relative);
    inertia +=
        own + params.mass_kg * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  all.angular_velocity_rad_s = inverse_of_symmetric(inertia) * angular;
  return all;
}

double relative_joule(const SceneDescription& scene, std::span<const BodyId> ids,
                      std::span<const BodyState> states, const Motion& motion) {
  double sum = 0.0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    BodyState relative;
    relative.orientation = states[i].orientation;
    relative.angular_velocity_rad_s =
        states[i].angular_velocity_rad_s - motion.angular_velocity_rad_s;
    const Vec3 velocity = states[i].linear_velocity_m_s - motion.velocity_at(states[i].position_m);
    sum +=
        0.5 * params.mass_kg * velocity.squaredNorm() + rotational_energy_joule(params, relative);
  }
  return sum;
}

void scale_relative(double factor, const Motion& motion, std::span<BodyState> states) {
  for (BodyState& state : states) {
    const Vec3 common = motion.velocity_at(state.position_m);
    state.linear_velocity_m_s += (state.linear_velocity_m_s - common) * (factor - 1.0);
    state.angular_velocity_rad_s +=
        (state.angular_velocity_rad_s - motion.angular_velocity_rad_s) * (factor - 1.0);
  }
}

struct Sum {
  double value = 0.0, scale = 0.0;

  void add(double part) {
    value += part;
    scale += std::abs(part);
  }
};

double row_work(const JointRow& row, std::span<const SolverBody> bodies) {
  return row.impulse_newton_s * velocity_of(row, bodies);
}

// Which bodies move by their final velocity.
Flights flights_of(const JointSystem& joints, const ContactProblem& problem) {
  Flights flights = find_flights(problem);
  for (const JointRow& row : joints.rows)
    flights[row.a].supported = flights[row.b].supported = true;
  return flights;
}

// External forces count as a field, motors and springs as work that is given.
Sum gain_of(double dt_s, std::span<const BodyState> before, std::span<const SolverBody> free,
            const Flights& held, const JointSystem& joints, const ContactProblem& problem) {
  Sum gain;
  const Flights flights = find_flights(problem);
  for (std::size_t i = 0; i < free.size(); ++i) {
    const SolverBody& body = problem.bodies[i];
    if (body.inverse_mass == 0.0) continue;  // kinematic
    const double mass = 1.0 / body.inverse_mass;
    const Vec3 &v0 = before[i].linear_velocity_m_s, &w0 = before[i].angular_velocity_rad_s;
    const Vec3 forced = free[i].linear - v0;
    Vec3 displacement = body.linear * dt_s;
    if (!held[i].supported) displacement -= forced * (0.5 * dt_s) + flights[i].not_yet_m;
    gain.add(0.5 * mass * (body.linear - v0).dot(body.linear + v0));
    gain.add(-mass * forced.dot(displacement) / dt_s);
    // What rests has a velocity of rounding: of the difference of this and of impulses.
    gain.scale += mass * forced.squaredNorm();
    const Mat3 inertia = inverse_of_symmetric(body.inverse_inertia);
    gain.add(0.5 * Vec3(inertia * (body.angular - w0)).dot(body.angular + w0));
    gain.add(-Vec3(inertia * (free[i].angular - w0)).dot(body.angular));
  }
  for (const JointRow& row : joints.rows)
    if (row.kind == JointRowKind::kMotor || row.kind == JointRowKind::kSpring)
      gain.add(-row_work(row, problem.bodies));
  gain.add(-kinematic_work_joule(free, problem));
  return gain;
}

// The largest share from 0 to 1 at which the quadratic through (0, at0), (1/2, at_half), (1, at1)
// is not positive, for at1 > 0.
double last_share(double at0, double at_half, double at1) {
  if (!(at0 < 0.0)) return 0.0;
  const double a = 2.0 * (at1 + at0 - 2.0 * at_half), b = at1 - at0 - a;
  const double root = std::sqrt(std::max(0.0, b * b - 4.0 * a * at0));
  const double share = b > 0.0 ? -2.0 * at0 / (b + root) : (root - b) / (2.0 * a);
  return share >= 0.0 && share <= 1.0 ? share : 0.0;
}

}  // namespace

bool is_isolated(std::size_t body_count, const JointSystem& joints, const ContactProblem* problem) {
  const auto fixed = [body_count](const auto& row) { return row.b >= body_count; };
  const auto held = [problem, fixed](const NormalRow& row) {
    return fixed(row) || problem->bodies[row.a].inverse_mass == 0.0 ||
           problem->bodies[row.b].inverse_mass == 0.0;
  };
  return std::ranges::none_of(joints.rows, fixed) &&
         (problem == nullptr || std::ranges::none_of(problem->normals, held));
}

EnergyExcess energy_excess(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                           std::span<const BodyState> from, std::span<const BodyState> to,
                           double work_joule) {
  EnergyExcess excess;
  excess.moving_joule = kinetic_joule(scene, ids, to);
  const double gain = gain_joule(scene, ids, from, to) - work_joule;
  double noise = kWorkRounding *
                 (excess.moving_joule + kinetic_joule(scene, ids, from) + std::abs(work_joule));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& body = scene.bodies[index_of(ids[i])];
    const double mass_kg = body.mass_kg, g = field_of(scene, body).norm(), fall = g * dt_s;
    excess.falling_joule += 0.5 * mass_kg * fall * fall;
    noise += mass_kg * (kFallPart * fall * fall + kEpsilon * g * from[i].position_m.norm());
  }
  if (!(std::abs(gain) <= noise)) excess.gain_joule = gain;
  return excess;
}

double take_excess(const SceneDescription& scene, std::span<const BodyId> ids,
                   const EnergyExcess& excess, bool isolated, std::span<BodyState> states,
                   IslandReport& report) {
  if (excess.gain_joule == 0.0) return 0.0;
  const auto factor = [&excess](double part_joule) {
    return std::sqrt(std::max(0.0, 1.0 - excess.gain_joule / part_joule));
  };
  Motion common;
  if (isolated) {
    // A hundredth: what does not bend has no energy of its own to take.
    common = common_motion(scene, ids, states);
    for (const bool rotates : {true, false}) {
      if (!rotates) common.angular_velocity_rad_s = Vec3::Zero();
      const double bending = relative_joule(scene, ids, states, common);
      if (std::abs(excess.gain_joule) > 0.01 * bending) continue;
      scale_relative(factor(bending), common, states);
      return 0.0;
    }
    common = {};
  }
  const double share = factor(excess.moving_joule);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    if (params.kinematic) continue;
    const Vec3 given = states[i].linear_velocity_m_s * ((share - 1.0) * params.mass_kg);
    const Vec3 twist =
        inertia_of(params, states[i]) * states[i].angular_velocity_rad_s * (share - 1.0);
    report.static_impulse_newton_s += given;
    report.static_angular_impulse_newton_m_s += states[i].position_m.cross(given) + twist;
  }
  scale_relative(share, common, states);
  return std::max(0.0, excess.gain_joule - excess.moving_joule);
}

bool take_trace(const SceneDescription& scene, std::span<const BodyId> ids,
                const EnergyExcess& excess, bool isolated, std::span<BodyState> states,
                IslandReport& report) {
  constexpr double kTrace = 1e-3;
  const double gain = std::abs(excess.gain_joule);
  if (!isolated) {
    if (!(gain <= kTrace * excess.moving_joule)) return false;
    take_excess(scene, ids, excess, false, states, report);
    return true;
  }
  const Motion common = common_motion(scene, ids, states);
  const double bending = relative_joule(scene, ids, states, common);
  if (!(gain <= kTrace * bending)) return false;
  if (gain > 0.0) scale_relative(std::sqrt(1.0 - excess.gain_joule / bending), common, states);
  return true;
}

void clamp_joint_gain(double dt_s, std::span<const BodyState> before,
                      std::span<const SolverBody> free, JointSystem& joints,
                      ContactProblem& problem) {
  const bool diverged = is_out_of_bounds(problem);
  const Sum gain = gain_of(dt_s, before, free, flights_of(joints, problem), joints, problem);
  if (!diverged && gain.value <= kWorkRounding * gain.scale) return;
  JointSystem reference_joints = joints;
  ContactProblem reference = problem;
  solve_unconstrained_reference(free, reference_joints, reference);
  if (diverged) {
    joints = std::move(reference_joints);
    problem = std::move(reference);
    return;
  }
  // Whatever acts in either solution acts in between, and that alone decides who is held.
  JointSystem trial_joints = joints;
  ContactProblem trial = problem;
  mix(0.5, reference_joints, reference, trial_joints, trial);
  const Flights held = flights_of(trial_joints, trial);
  const double one = gain_of(dt_s, before, free, held, joints, problem).value;
  const double half = gain_of(dt_s, before, free, held, trial_joints, trial).value;
  const double none = gain_of(dt_s, before, free, held, reference_joints, reference).value;
  if (one > 0.0) mix(last_share(none, half, one), reference_joints, reference, joints, problem);
}

double external_work_joule(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                           std::span<const BodyState> before, std::span<const SolverBody> free,
                           const ContactProblem& problem) {
  double sum = 0.0;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const SolverBody& body = problem.bodies[i];
    if (body.inverse_mass == 0.0) continue;
    const Vec3 push =
        free[i].linear - before[i].linear_velocity_m_s - field_of(scene, ids[i]) * dt_s;
    const Vec3 angular = free[i].angular - before[i].angular_velocity_rad_s;
    sum += push.dot(body.linear) / body.inverse_mass;
    sum += Vec3(inverse_of_symmetric(body.inverse_inertia) * angular).dot(body.angular);
  }
  return sum;
}

double motor_work_joule(const JointSystem& joints, std::span<const SolverBody> bodies) {
  double sum = 0.0;
  for (const JointRow& row : joints.rows)
    if (row.kind == JointRowKind::kMotor) sum += row_work(row, bodies);
  return sum;
}

}  // namespace soda::physics
