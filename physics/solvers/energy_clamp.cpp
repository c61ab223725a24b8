#include "physics/solvers/energy_clamp.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {
namespace {

// Of a whole: then all impulses that act in either of two solutions act.
constexpr double kAlmost = 1.0 - 1e-9;
constexpr double kTrace = 0.999;

// Impulses times the relative velocities of their points, which have those of `bodies` (the
// problem's own where there are none: statics and surfaces).
Work power(std::span<const SolverBody> bodies, const ContactProblem& problem) {
  const auto body = [&](std::uint32_t i) -> const SolverBody& {
    return i < bodies.size() ? bodies[i] : problem.bodies[i];
  };
  Work work;
  for (const NormalRow& row : problem.normals) {
    const SolverBody &a = body(row.a), &b = body(row.b);
    work.add(row.impulse_newton_s * (row.normal.dot(b.linear - a.linear) +
                                     row.arm_b.dot(b.angular) - row.arm_a.dot(a.angular)));
  }
  for (const FrictionRow& row : problem.frictions) {
    const SolverBody &a = body(row.a), &b = body(row.b);
    const Vec3 velocity =
        b.linear + b.angular.cross(row.arm_b) - a.linear - a.angular.cross(row.arm_a);
    for (int t = 0; t < 2; ++t) work.add(row.impulse_newton_s[t] * velocity.dot(row.tangent[t]));
  }
  for (const RollingRow& row : problem.rollings)
    work.add(torque_impulse(row).dot(body(row.b).angular - body(row.a).angular));
  return work;
}

// Energy that the step gives the island. `held`: which bodies move by their final velocity.
Work gain(const SolveStep& step, std::span<const SolverBody> free, const Flights& held,
          const ContactProblem& problem) {
  StepWork work;
  add_contacts(free, problem, work);
  add_fields(step, free, held, find_flights(problem), problem, work);
  return gain_of(work);
}

// How much of the way from `plastic` to what the problem holds can be gone without a gain.
double share_of_rebounds(const SolveStep& step, std::span<const SolverBody> free,
                         const SolvedContacts& plastic, const ContactProblem& problem) {
  const std::span<const SolverBody> start = std::span(plastic.bodies).first(free.size());
  // Whatever acts in either solution acts in between, and that alone decides who is held.
  ContactProblem trial = problem;
  take_share(0.5, start, &plastic, trial);
  const Flights held = find_flights(trial);
  const double one = gain(step, free, held, problem).sum;
  const double half = gain(step, free, held, trial).sum;
  take_share(0.0, start, &plastic, trial);
  const double none = gain(step, free, held, trial).sum;
  return one > 0.0 || none > 0.0 ? share_without_gain(none, half, one) : kAlmost;
}

double most_joule(const Driven& driven) {
  const double root =
      std::sqrt(driven.without_joule) + driven.surface_m_s * std::sqrt(0.5 * driven.mass_kg);
  return root * root;
}

}  // namespace

void Driven::add(const Driven& other) {
  surface_m_s = std::max(surface_m_s, other.surface_m_s);
  mass_kg += other.mass_kg;
  without_joule += other.without_joule;
  half_joule += other.half_joule;
  after_joule += other.after_joule;
}

bool is_too_fast(const Driven& driven) {
  constexpr double kRounding = 1e-9;
  return driven.surface_m_s > 0.0 && driven.after_joule > (1.0 + kRounding) * most_joule(driven);
}

double share_as_driven(const Driven& driven) {
  const double most = most_joule(driven);
  return share_without_gain(driven.without_joule - most, driven.half_joule - most,
                            driven.after_joule - most);
}

void StepWork::add(const StepWork& other) {
  after.add(other.after);
  without.add(other.without);
  fields.add(other.fields);
  driven.add(other.driven);
}

void add_driven(std::span<const SolverBody> start, const ContactProblem& problem, StepWork& work) {
  Driven& driven = work.driven;
  for (std::size_t i = start.size() + 1; i < problem.bodies.size(); ++i)
    driven.surface_m_s = std::max(driven.surface_m_s, problem.bodies[i].linear.norm());
  const auto joule = [](double mass, const Mat3& inertia, const Vec3& linear, const Vec3& angular) {
    return 0.5 * (mass * linear.squaredNorm() + angular.dot(Vec3(inertia * angular)));
  };
  for (std::size_t i = 0; i < start.size(); ++i) {
    const SolverBody &from = start[i], &to = problem.bodies[i];
    if (from.inverse_mass == 0.0) {  // a surface, too
      driven.surface_m_s = std::max(driven.surface_m_s, from.linear.norm());
      continue;
    }
    const double mass = 1.0 / from.inverse_mass;
    const Mat3 inertia = inverse_of_symmetric(from.inverse_inertia);
    driven.mass_kg += mass;
    driven.without_joule += joule(mass, inertia, from.linear, from.angular);
    driven.half_joule +=
        joule(mass, inertia, 0.5 * (from.linear + to.linear), 0.5 * (from.angular + to.angular));
    driven.after_joule += joule(mass, inertia, to.linear, to.angular);
  }
}

void add_contacts(std::span<const SolverBody> free, const ContactProblem& problem, StepWork& work) {
  work.after.add(power(std::span(problem.bodies).first(free.size()), problem));
  work.without.add(power(free, problem));
}

void add_fields(const SolveStep& step, std::span<const SolverBody> free, const Flights& held,
                const Flights& flights, const ContactProblem& problem, StepWork& work) {
  const double dt_s = step.dt_s;
  for (std::size_t i = 0; i < free.size(); ++i) {
    if (free[i].inverse_mass == 0.0) continue;
    const double mass = 1.0 / free[i].inverse_mass;
    const Vec3& start = step.before[i].linear_velocity_m_s;
    const Vec3 forced = free[i].linear - start;
    if (forced == Vec3::Zero()) continue;  // an impact takes no time
    Vec3 displacement = problem.bodies[i].linear * dt_s;
    if (!held[i].supported) displacement -= forced * (0.5 * dt_s) + flights[i].not_yet_m;
    work.fields.add(0.5 * mass * forced.dot(free[i].linear + start));
    work.fields.add(-mass * forced.dot(displacement) / dt_s);
  }
}

Work gain_of(const StepWork& work) {
  Work gain{0.5 * (work.after.sum + work.without.sum),
            0.5 * (work.after.scale + work.without.scale)};
  gain.add(work.fields);
  return gain;
}

bool is_more_than_rounding(const Work& work) {
  constexpr double kContactRounding = 1e-13;
  return work.sum > kContactRounding * work.scale;
}

bool gives_energy(const StepWork& work) {
  return is_more_than_rounding(gain_of(work)) || is_too_fast(work.driven);
}

double share_without_work(const StepWork& work) {
  if (!is_more_than_rounding(work.after)) return 1.0;
  const double without = work.without.sum;
  return without < 0.0 ? without / (without - work.after.sum) : 0.0;
}

double allowed_share(const StepWork& work) {
  const double share = is_more_than_rounding(gain_of(work)) ? share_without_work(work) : 1.0;
  return is_too_fast(work.driven) ? std::min(share, share_as_driven(work.driven)) : share;
}

void take_share(double share, std::span<const SolverBody> from_bodies, const SolvedContacts* from,
                ContactProblem& problem) {
  for (std::size_t i = 0; i < from_bodies.size(); ++i) {
    SolverBody& body = problem.bodies[i];
    const SolverBody& start = from_bodies[i];
    body.linear = start.linear + (body.linear - start.linear) * share;
    body.angular = start.angular + (body.angular - start.angular) * share;
  }
  const auto mixed = [share](double start, double end) { return start + (end - start) * share; };
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    double& impulse = problem.normals[i].impulse_newton_s;
    impulse = mixed(from ? from->normal_newton_s[i] : 0.0, impulse);
  }
  for (std::size_t i = 0; i < problem.frictions.size(); ++i)
    for (int t = 0; t < 2; ++t) {
      double& impulse = problem.frictions[i].impulse_newton_s[t];
      impulse = mixed(from ? from->friction_newton_s[i][t] : 0.0, impulse);
    }
  if (!problem.rollings.empty())
    mix_rolling(share, from ? std::span(from->rollings) : std::span<const RollingRow>(), problem);
}

double share_without_gain(double at0, double at_half, double at1) {
  if (at0 > 0.0) return 0.0;
  const double a = 2.0 * (at1 + at0 - 2.0 * at_half), b = at1 - at0 - a;
  const double root = std::sqrt(std::max(0.0, b * b - 4.0 * a * at0));
  // Without cancellation, whichever sign b has.
  const double share = b > 0.0 ? -2.0 * at0 / (b + root) : (root - b) / (2.0 * a);
  return share >= 0.0 && share <= 1.0 ? share : 0.0;
}

void clamp_work(std::span<const SolverBody> free, ContactProblem& problem) {
  StepWork work;
  add_contacts(free, problem, work);
  const double share = share_without_work(work);
  if (share != 1.0) take_share(share, free, nullptr, problem);
}

void clamp_gain(const SolveStep& step, std::span<const SolverBody> free, ContactProblem& problem) {
  if (is_more_than_rounding(gain(step, free, find_flights(problem), problem)))
    clamp_work(free, problem);
}

SolvedContacts solved_contacts(const ContactProblem& problem) {
  SolvedContacts solved;
  solved.bodies = problem.bodies;
  solved.normal_newton_s.reserve(problem.normals.size());
  solved.friction_newton_s.reserve(problem.frictions.size());
  for (const NormalRow& row : problem.normals)
    solved.normal_newton_s.push_back(row.impulse_newton_s);
  for (const FrictionRow& row : problem.frictions)
    solved.friction_newton_s.push_back({row.impulse_newton_s[0], row.impulse_newton_s[1], 0.0});
  solved.rollings = problem.rollings;
  return solved;
}

void clamp_rebounds(const SolveStep& step, std::span<const SolverBody> free,
                    const SolvedContacts& plastic, ContactProblem& problem) {
  const std::span<const SolverBody> start = std::span(plastic.bodies).first(free.size());
  if (!is_more_than_rounding(gain(step, free, find_flights(problem), problem))) return;
  double share = share_of_rebounds(step, free, plastic, problem);
  if (share < kTrace) {
    // What is left of an impact without rebound belongs to the step's end, not to the impact's
    // time: with more than a trace of it, bodies move by their final velocity.
    for (RowContact& contact : problem.contacts) contact.bounces = false;
    share = share_of_rebounds(step, free, plastic, problem);
  }
  take_share(share, start, &plastic, problem);
}

bool aim_to_close(double dt_s, ContactProblem& problem) {
  const auto closed = [&](std::size_t i) {
    return -std::max(problem.contacts[i].separation_m, 0.0) / dt_s;
  };
  Flights flights;
  bool any = false;
  for (std::size_t i = 0; i < problem.normals.size() && !any; ++i) {
    const NormalRow& row = problem.normals[i];
    if (!(row.target_m_s < closed(i))) continue;
    if (flights.empty()) flights = find_flights(problem);
    const SolverBody &a = problem.bodies[row.a], &b = problem.bodies[row.b];
    const double velocity =
        row.normal.dot(b.linear - a.linear) + row.arm_b.dot(b.angular) - row.arm_a.dot(a.angular);
    any = (flights[row.a].supported || flights[row.b].supported) && velocity < closed(i);
  }
  if (!any) return false;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    problem.normals[i].target_m_s = closed(i);
    problem.contacts[i].bounces = false;
  }
  return true;
}

double kinematic_work_joule(std::span<const SolverBody> free, const ContactProblem& problem) {
  double work = 0.0;
  const auto velocity = [&](std::uint32_t body, const Vec3& arm) {
    if (body >= free.size() || free[body].inverse_mass > 0.0) return Vec3(Vec3::Zero());
    return Vec3(free[body].linear + free[body].angular.cross(arm));
  };
  for (const NormalRow& row : problem.normals) {
    const Vec3 arm_a = row.normal.cross(row.arm_a), arm_b = row.normal.cross(row.arm_b);
    work += row.impulse_newton_s * row.normal.dot(velocity(row.a, arm_a) - velocity(row.b, arm_b));
  }
  for (const FrictionRow& row : problem.frictions)
    for (int t = 0; t < 2; ++t)
      work += row.impulse_newton_s[t] *
              row.tangent[t].dot(velocity(row.a, row.arm_a) - velocity(row.b, row.arm_b));
  const auto angular_velocity = [&](std::uint32_t body) {
    return body < free.size() && free[body].inverse_mass == 0.0 ? free[body].angular
                                                                : Vec3(Vec3::Zero());
  };
  for (const RollingRow& row : problem.rollings)
    work += torque_impulse(row).dot(angular_velocity(row.a) - angular_velocity(row.b));
  return work;
}

}  // namespace soda::physics
