#include "physics/solvers/jointed_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/anderson.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/solvers/convex_contacts.hpp"

namespace soda::physics {
namespace {

constexpr double kNegligibleJoint = 1e-12;  // change of an impulse, of the largest impulse
// Contacts that hold the same thing twice hand impulses on to each other for ever, by rounding. A
// block of iterations whose least change is not less than that of the block before is the last.
constexpr int kBlock = 10;
constexpr double kGained = 0.9;
// By how much the two ways to tell a direction's inverse mass may differ, as part of it.
constexpr double kUnclear = 1e-3;
// The largest ratio of a lever: how much faster than the contact itself it makes something.
constexpr double kMostLever = 30.0;

// One direction of a contact, as seen by its two bodies.
struct Direction {
  std::uint32_t a = 0, b = 0;
  Vec3 linear = Vec3::Zero(), angular_a = Vec3::Zero(), angular_b = Vec3::Zero();
};

Direction normal_of(const NormalRow& row) {
  return {row.a, row.b, row.normal, row.arm_a, row.arm_b};
}

Direction tangent_of(const FrictionRow& row, int t) {
  const Vec3& tangent = row.tangent[t];
  return {row.a, row.b, tangent, row.arm_a.cross(tangent), row.arm_b.cross(tangent)};
}

Direction rolling_of(const RollingRow& row, int axis) {
  return {row.a, row.b, Vec3::Zero(), row.axis[axis], row.axis[axis]};
}

template <class Body>
double along(const Direction& d, const Body& a, const Body& b) {
  return d.linear.dot(b.linear - a.linear) + d.angular_b.dot(b.angular) -
         d.angular_a.dot(a.angular);
}

// What an impulse does: first to its own bodies, then, by the joints, to all.
class Response {
 public:
  Response(const JointSystem& joints, std::span<const SolverBody> bodies)
      : joints_(joints), bodies_(bodies) {}

  JointedDirection to(const Direction& d) {
    constexpr int kMostCorrections = 3;
    JointedDirection all;
    all.moves.resize(bodies_.size());
    give(d.a, -1.0, d.linear, d.angular_a, all);
    give(d.b, 1.0, d.linear, d.angular_b, all);
    hold_joints(all);
    measure(d, all);
    // What is light beside what it hangs on moves by the difference of large numbers. Where the
    // joints allow no motion at all, each correction only leaves less of it.
    for (int i = 0; i < kMostCorrections && !all.is_clear; ++i) {
      const double before = all.inverse_mass;
      hold_joints(all);
      measure(d, all);
      const double change = std::abs(all.inverse_mass - before);
      all.is_clear = all.is_clear && change <= kUnclear * std::abs(all.inverse_mass);
    }
    return all;
  }

 private:
  void give(std::uint32_t body, double sign, const Vec3& linear, const Vec3& angular,
            JointedDirection& all) const {
    all.moves[body].linear += linear * (sign * bodies_[body].inverse_mass);
    all.moves[body].angular += bodies_[body].inverse_inertia * angular * sign;
  }

  // Takes away the velocities that the joints do not allow.
  void hold_joints(JointedDirection& all) {
    rows_.clear();
    for (const JointRow& row : joints_.rows) {
      const JointMove &a = all.moves[row.a], &b = all.moves[row.b];
      rows_.push_back(row.angular_a.dot(a.angular) - row.angular_b.dot(b.angular) -
                      row.linear.dot(b.linear - a.linear));
    }
    solve_joint_rows(joints_, rows_);
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (rows_[r] == 0.0) continue;
      const JointRow& row = joints_.rows[r];
      give(row.a, -rows_[r], row.linear, row.angular_a, all);
      give(row.b, rows_[r], row.linear, row.angular_b, all);
    }
  }

  void measure(const Direction& d, JointedDirection& all) const {
    all.inverse_mass = along(d, all.moves[d.a], all.moves[d.b]);
    double twice_joule = 0.0;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].inverse_mass == 0.0) continue;
      const JointMove& move = all.moves[i];
      const Mat3 inertia = inverse_of_symmetric(bodies_[i].inverse_inertia);
      twice_joule += move.linear.squaredNorm() / bodies_[i].inverse_mass +
                     Vec3(inertia * move.angular).dot(move.angular);
    }
    all.is_clear =
        std::abs(all.inverse_mass - twice_joule) <= kUnclear * twice_joule && twice_joule > 0.0;
  }

  const JointSystem& joints_;
  std::span<const SolverBody> bodies_;
  std::vector<double> rows_;
};

// Of the fastest body's points at its radius of gyration, m/s for 1 newton s.
double fastest_m_s(const JointedDirection& direction, std::span<const SolverBody> bodies) {
  double most = 0.0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].inverse_mass == 0.0) continue;
    const double radius_m = std::sqrt(bodies[i].inverse_mass / bodies[i].inverse_inertia.norm());
    const JointMove& move = direction.moves[i];
    most = std::max(most, move.linear.norm() + radius_m * move.angular.norm());
  }
  return most;
}

void push(const JointedDirection& direction, double impulse, std::span<SolverBody> bodies) {
  if (impulse == 0.0) return;
  for (std::size_t i = 0; i < direction.moves.size(); ++i) {
    bodies[i].linear += direction.moves[i].linear * impulse;
    bodies[i].angular += direction.moves[i].angular * impulse;
  }
}

double solve_normal(const JointedDirection& direction, NormalRow& row,
                    std::span<SolverBody> bodies) {
  const double velocity = along(normal_of(row), bodies[row.a], bodies[row.b]);
  const double impulse =
      std::max(0.0, row.impulse_newton_s +
                        (row.target_m_s - velocity - direction.give_1_kg * row.impulse_newton_s) /
                            (direction.inverse_mass + direction.give_1_kg));
  const double change = impulse - row.impulse_newton_s;
  row.impulse_newton_s = impulse;
  push(direction, change, bodies);
  return std::abs(change);
}

// A step along the velocity itself, and back into the disc: friction opposes the motion.
double solve_friction(const JointedDirection* tangents, double step_kg, double limit,
                      FrictionRow& row, std::span<SolverBody> bodies) {
  double change[2] = {0.0, 0.0}, wanted[2];
  for (int t = 0; t < 2; ++t)
    wanted[t] =
        row.impulse_newton_s[t] - step_kg * along(tangent_of(row, t), bodies[row.a], bodies[row.b]);
  const double length = std::sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1]);
  const double share = length > limit ? limit / length : 1.0;
  for (int t = 0; t < 2; ++t) {
    change[t] = wanted[t] * share - row.impulse_newton_s[t];
    row.impulse_newton_s[t] += change[t];
    push(tangents[t], change[t], bodies);
  }
  return std::max(std::abs(change[0]), std::abs(change[1]));
}

// The same in the contact plane, and within its bound about the normal.
double solve_rolling(const JointedDirection* rollings, double step_kg_m2, double pressed,
                     RollingRow& row, std::span<SolverBody> bodies) {
  const Vec3 old = row.impulse_newton_m_s;
  const auto velocity = [&](int t) {
    return rollings[t].moves.empty() ? 0.0
                                     : along(rolling_of(row, t), bodies[row.a], bodies[row.b]);
  };
  Vec3 wanted(old[0] - step_kg_m2 * velocity(0), old[1] - step_kg_m2 * velocity(1), old[2]);
  const double length = std::sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1]);
  const double limit = row.rolling_m * pressed;
  for (int t = 0; t < 2; ++t) {
    if (length > limit) wanted[t] *= limit / length;
    push(rollings[t], wanted[t] - old[t], bodies);
  }
  if (!rollings[2].moves.empty()) {
    const double most = row.torsional_m * pressed;
    wanted[2] = std::clamp(old[2] - velocity(2) / rollings[2].inverse_mass, -most, most);
    push(rollings[2], wanted[2] - old[2], bodies);
  }
  row.impulse_newton_m_s = wanted;
  return (wanted - old).cwiseAbs().maxCoeff() / row.gyration_m;
}

double iterate(bool forward, const JointedContacts& contacts, ContactProblem& problem) {
  double change = 0.0;
  for (std::size_t r = 0; r < problem.rollings.size(); ++r) {
    RollingRow& row = problem.rollings[r];
    change =
        std::max(change, solve_rolling(&contacts.rollings[3 * r], contacts.slide_inertia_kg_m2[r],
                                       pressing(row, problem), row, problem.bodies));
  }
  for (std::size_t f = 0; f < problem.frictions.size(); ++f) {
    FrictionRow& row = problem.frictions[f];
    const double limit = row.friction * problem.normals[row.normal_row].impulse_newton_s;
    change = std::max(change, solve_friction(&contacts.tangents[2 * f], contacts.slide_mass_kg[f],
                                             limit, row, problem.bodies));
  }
  const std::size_t count = problem.normals.size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = forward ? k : count - 1 - k;
    change =
        std::max(change, solve_normal(contacts.normals[i], problem.normals[i], problem.bodies));
  }
  return change;
}

void impulses_of(const ContactProblem& problem, std::vector<double>& impulses) {
  impulses.clear();
  for (const NormalRow& row : problem.normals) impulses.push_back(row.impulse_newton_s);
  for (const FrictionRow& row : problem.frictions)
    impulses.insert(impulses.end(), row.impulse_newton_s, row.impulse_newton_s + 2);
  for (const RollingRow& row : problem.rollings)
    for (int t = 0; t < 3; ++t) impulses.push_back(row.impulse_newton_m_s[t]);
}

// The next sweep brings friction back into its bounds.
void set_impulses(std::span<const double> impulses, const JointedContacts& contacts,
                  ContactProblem& problem) {
  std::size_t next = 0;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    NormalRow& row = problem.normals[i];
    const double impulse = std::max(0.0, impulses[next++]);
    push(contacts.normals[i], impulse - row.impulse_newton_s, problem.bodies);
    row.impulse_newton_s = impulse;
  }
  for (std::size_t i = 0; i < problem.frictions.size(); ++i)
    for (std::size_t t = 0; t < 2; ++t) {
      double& impulse = problem.frictions[i].impulse_newton_s[t];
      push(contacts.tangents[2 * i + t], impulses[next] - impulse, problem.bodies);
      impulse = impulses[next++];
    }
  for (std::size_t i = 0; i < problem.rollings.size(); ++i)
    for (std::size_t t = 0; t < 3; ++t) {
      double& impulse = problem.rollings[i].impulse_newton_m_s[static_cast<int>(t)];
      push(contacts.rollings[3 * i + t], impulses[next] - impulse, problem.bodies);
      impulse = impulses[next++];
    }
}

// False where it leads far away.
bool accelerate(std::span<const double> from, std::vector<double>& to,
                AndersonAcceleration& acceleration) {
  constexpr double kFarthest = 100.0;  // of what the sweeps have changed
  const std::vector<double> swept = to;
  acceleration.accelerate(from, to);
  double changed = 0.0, led = 0.0;
  for (std::size_t k = 0; k < to.size(); ++k) {
    changed = std::max(changed, std::abs(swept[k] - from[k]));
    led = std::max(led, std::abs(to[k] - swept[k]));
  }
  return led <= kFarthest * changed;
}

// 1 / the larger eigenvalue of the response of two directions; `across`: of one to the other.
double slide_mass(const double (&inverse)[2], double across) {
  const double half = 0.5 * (inverse[0] - inverse[1]);
  const double most = 0.5 * (inverse[0] + inverse[1]) + std::sqrt(half * half + across * across);
  return most > 0.0 ? 1.0 / most : 0.0;
}

void add_rolling(const RollingRow& row, Response& response, JointedContacts& contacts) {
  double inverse[2] = {0.0, 0.0}, across = 0.0;
  for (int t = 0; t < 3; ++t) {
    contacts.rollings.push_back(response.to(rolling_of(row, t)));
    JointedDirection& rolling = contacts.rollings.back();
    if (!rolling.is_clear) rolling.moves.clear();
    if (rolling.moves.empty() || t == 2) continue;
    inverse[t] = rolling.inverse_mass;
    if (t == 0) across = along(rolling_of(row, 1), rolling.moves[row.a], rolling.moves[row.b]);
  }
  contacts.slide_inertia_kg_m2.push_back(slide_mass(inverse, across));
}

}  // namespace

bool is_stalled(double change, double before) { return change > kGained * before; }

std::optional<JointedContacts> jointed_contacts(const JointSystem& joints,
                                                const ContactProblem& problem) {
  constexpr std::size_t kMost = 20000;
  const std::size_t directions =
      problem.normals.size() + 2 * problem.frictions.size() + 3 * problem.rollings.size();
  if (directions * problem.bodies.size() > kMost) return std::nullopt;
  JointedContacts contacts;
  Response response(joints, problem.bodies);
  for (const NormalRow& row : problem.normals) {
    contacts.normals.push_back(response.to(normal_of(row)));
    JointedDirection& direction = contacts.normals.back();
    if (!direction.is_clear) return std::nullopt;
    direction.give_1_kg =
        std::max(0.0, fastest_m_s(direction, problem.bodies) / kMostLever - direction.inverse_mass);
  }
  for (const FrictionRow& row : problem.frictions) {
    double inverse[2], across = 0.0;
    for (int t = 0; t < 2; ++t) {
      contacts.tangents.push_back(response.to(tangent_of(row, t)));
      if (!contacts.tangents.back().is_clear) return std::nullopt;
      inverse[t] = contacts.tangents.back().inverse_mass;
      const std::vector<JointMove>& moves = contacts.tangents.back().moves;
      if (t == 0) across = along(tangent_of(row, 1), moves[row.a], moves[row.b]);
    }
    contacts.slide_mass_kg.push_back(slide_mass(inverse, across));
  }
  for (const RollingRow& row : problem.rollings) add_rolling(row, response, contacts);
  return contacts;
}

JointedSolve solve_jointed_velocities(int iterations, const JointedContacts& contacts,
                                      ContactProblem& problem) {
  AndersonAcceleration acceleration;
  std::vector<double> from, to;
  double before = 1e300, block = 1e300, least = 1e300;  // block: of the one before
  for (int i = 2;; i += 2) {
    impulses_of(problem, from);
    iterate(true, contacts, problem);
    const double change = iterate(false, contacts, problem);
    double largest = 0.0;
    for (const NormalRow& row : problem.normals) largest = std::max(largest, row.impulse_newton_s);
    least = std::min(least, change);
    const bool stalls = i % kBlock == 0 && is_stalled(least, block);
    if (change <= kNegligibleJoint * largest || stalls || i >= iterations) return {i, least};
    if (i % kBlock == 0) block = std::exchange(least, 1e300);
    if (change > before) acceleration.restart();
    before = change;
    impulses_of(problem, to);
    if (accelerate(from, to, acceleration)) set_impulses(to, contacts, problem);
  }
}

}  // namespace soda::physics
