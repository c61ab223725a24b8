#include "physics/solvers/substeps.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/carried_rows.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/softness.hpp"

namespace soda::physics {

double gap_m(const ContactProblem& problem, std::size_t i,
             const std::vector<Displacement>& displacements) {
  const NormalRow& row = problem.normals[i];
  const Displacement& a = displacements[row.a];
  const Displacement& b = displacements[row.b];
  const RowContact& contact = problem.contacts[i];
  return contact.separation_m + contact.carried_m + row.normal.dot(b.linear_m - a.linear_m) +
         row.arm_b.dot(b.angular_rad) - row.arm_a.dot(a.angular_rad);
}

namespace {

// Of what overlaps.
constexpr Softness kSoft = spring_of(kPhaseOfSubstep, 10.0);

inline void give(const NormalRow& row, double change, SolverBody& a, SolverBody& b) {
  a.linear -= row.normal * (a.inverse_mass * change);
  a.angular -= row.response_a * change;
  b.linear += row.normal * (b.inverse_mass * change);
  b.angular += row.response_b * change;
}

template <bool kPresses>
void iterate(ContactProblem& problem, const Substeps& substeps) {
  iterate_frictions(problem);
  const std::size_t count = problem.normals.size();
  const double per_second = 1.0 / substeps.length_s;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = kPresses ? k : count - 1 - k;
    NormalRow& row = problem.normals[i];
    SolverBody& a = problem.bodies[row.a];
    SolverBody& b = problem.bodies[row.b];
    const double velocity =
        row.normal.dot(b.linear - a.linear) + row.arm_b.dot(b.angular) - row.arm_a.dot(a.angular);
    const double gap = gap_m(problem, i, substeps.displacements);
    double wanted = row.impulse_newton_s;
    if (gap > 0.0 || !kPresses) {
      wanted -= row.mass_kg * (velocity + std::max(gap, 0.0) * per_second);
    } else {
      const RowContact& contact = problem.contacts[i];
      const double target = std::min(kSoft.rate * std::max(-gap - contact.slop_m, 0.0) * per_second,
                                     contact.fastest_correction_m_s);
      wanted += kSoft.mass_share * row.mass_kg * (target - velocity) - kSoft.impulse_share * wanted;
    }
    wanted = wanted > 0.0 ? wanted : 0.0;
    const double change = wanted - row.impulse_newton_s;
    if (change == 0.0) continue;
    row.impulse_newton_s = wanted;
    give(row, change, a, b);
  }
}

void share_start_impulses(std::uint32_t count, ContactProblem& problem) {
  const double share = 1.0 / count;
  for (NormalRow& row : problem.normals) row.impulse_newton_s *= share;
  for (FrictionRow& row : problem.frictions)
    for (double& impulse : row.impulse_newton_s) impulse *= share;
  for (RollingRow& row : problem.rollings) row.impulse_newton_m_s *= share;
}

void add_impulses(const ContactProblem& problem, Substeps& substeps) {
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    double* const sum = &substeps.sum_newton_s[3 * i];
    sum[0] += problem.normals[i].impulse_newton_s;
    const std::int32_t friction = problem.contacts[i].friction_row;
    if (friction < 0) continue;
    sum[1] += problem.frictions[friction].impulse_newton_s[0];
    sum[2] += problem.frictions[friction].impulse_newton_s[1];
  }
  for (std::size_t i = 0; i < problem.rollings.size(); ++i)
    substeps.sum_newton_m_s[i] += problem.rollings[i].impulse_newton_m_s;
}

}  // namespace

std::uint32_t substeps_of(const SolverSettings& settings) {
  return static_cast<std::uint32_t>(std::max(1, (settings.iterations + 2) / 4));
}

namespace {

// How far contacts give way under the impulses of the step before, in sizes of the smaller body:
// the springs' deflection at rest, with that many substeps. Of nine pairs in ten; a few may have
// hit each other.
double sag_under_load(const SolveStep& step, std::uint32_t count) {
  const auto& [scene, dt_s, ids, states] = step;
  constexpr double kOthers = 0.1;
  std::vector<double> loads;  // of pairs: speed that the impulses give the lighter body, in sizes
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::vector<ContactImpulse>& impulses = states[i].impulses;
    for (std::size_t k = 0; k < impulses.size();) {
      const BodyId other = impulses[k].other;
      double sum_newton_s = 0.0;
      for (; k < impulses.size() && impulses[k].other == other; ++k)
        sum_newton_s += impulses[k].normal_newton_s;
      double mass_kg = 1e300, size_m = 1e300;  // of what is moved
      for (const BodyId id : {ids[i], other}) {
        if (!falls(scene, id)) continue;
        const BodyParams& body = scene.bodies[index_of(id)];
        mass_kg = std::min(mass_kg, body.mass_kg);
        size_m = std::min(size_m, size_of(scene, body.shape));
      }
      const double load = sum_newton_s / (mass_kg * size_m);
      if (std::isfinite(load)) loads.push_back(load);  // faults are told elsewhere
    }
  }
  if (loads.empty()) return 0.0;
  const auto most = loads.end() - 1 - static_cast<std::ptrdiff_t>(kOthers * loads.size());
  std::ranges::nth_element(loads, most);
  return *most * dt_s / (count * count * kPhaseOfSubstep * kPhaseOfSubstep);
}

}  // namespace

std::uint32_t substeps_under_load(const SolveStep& step) {
  constexpr double kMostSag = 2e-3;  // of the smaller body
  std::uint32_t count = substeps_of(step.scene.solver);
  const std::uint32_t most = kMostTimesSubsteps * count;
  // Twice as many give way by a quarter. Numbers between would change with every touch, and what
  // comes to rest would not.
  for (double sag = sag_under_load(step, count); sag > kMostSag && count < most; sag *= 0.25)
    count *= 2;
  return count;
}

void begin_substeps(double dt_s, std::uint32_t count, const IndexedSpan<BodyState>& states,
                    ContactProblem& problem, Substeps& substeps) {
  const double share = 1.0 / count;
  substeps.count = count;
  substeps.length_s = dt_s * share;
  substeps.displacements.assign(problem.bodies.size(), {});
  substeps.at_start.resize(states.size());
  substeps.sum_newton_s.assign(3 * problem.normals.size(), 0.0);
  substeps.sum_newton_m_s.assign(problem.rollings.size(), Vec3::Zero());
  for (std::size_t i = 0; i < states.size(); ++i) {
    SolverBody& body = problem.bodies[i];
    PositionCorrection& start = substeps.at_start[i];
    start = {states[i].linear_velocity_m_s, states[i].angular_velocity_rad_s};
    body.linear = start.linear + (body.linear - start.linear) * share;
    body.angular = start.angular + (body.angular - start.angular) * share;
  }
  share_start_impulses(count, problem);
}

void press(ContactProblem& problem, const Substeps& substeps) { iterate<true>(problem, substeps); }

void relax(ContactProblem& problem, Substeps& substeps) {
  iterate<false>(problem, substeps);
  add_impulses(problem, substeps);
}

void move_on(const ContactProblem& problem, Substeps& substeps) {
  for (std::size_t i = 0; i < substeps.at_start.size(); ++i) {
    substeps.displacements[i].linear_m += problem.bodies[i].linear * substeps.length_s;
    substeps.displacements[i].angular_rad += problem.bodies[i].angular * substeps.length_s;
  }
}

void go_on(ContactProblem& problem, Substeps& substeps) {
  for (std::size_t i = 0; i < substeps.at_start.size(); ++i) {
    SolverBody& body = problem.bodies[i];
    PositionCorrection& start = substeps.at_start[i];
    const PositionCorrection end{body.linear, body.angular};
    body.linear += end.linear - start.linear;
    body.angular += end.angular - start.angular;
    start = end;
  }
}

void end_substeps(ContactProblem& problem, const Substeps& substeps) {
  const double per_second = 1.0 / substeps.length_s;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const double* const sum = &substeps.sum_newton_s[3 * i];
    problem.normals[i].target_m_s =
        -std::max(gap_m(problem, i, substeps.displacements), 0.0) * per_second;
    problem.normals[i].impulse_newton_s = sum[0];
    const std::int32_t friction = problem.contacts[i].friction_row;
    if (friction < 0) continue;
    problem.frictions[friction].impulse_newton_s[0] = sum[1];
    problem.frictions[friction].impulse_newton_s[1] = sum[2];
  }
  for (std::size_t i = 0; i < problem.rollings.size(); ++i)
    problem.rollings[i].impulse_newton_m_s = substeps.sum_newton_m_s[i];
}

namespace {

// The part of `beyond` that lies on the way back to what the velocity was.
Vec3 towards_first(const Vec3& beyond, const Vec3& first, const Vec3& last) {
  const Vec3 change = first - last;
  const double squared = change.squaredNorm();
  if (!(squared > 0.0)) return Vec3::Zero();
  return change * std::clamp(beyond.dot(change) / squared, 0.0, 1.0);
}

}  // namespace

PositionCorrection beyond_final_velocity(double dt_s, const FastestCorrection& most,
                                         const BodyState& before, const SolverBody& body,
                                         const Flight& flight, const Displacement& displacement) {
  if (!flight.supported) return {};
  const PositionCorrection beyond{displacement.linear_m * (1.0 / dt_s) - body.linear,
                                  displacement.angular_rad * (1.0 / dt_s) - body.angular};
  const PositionCorrection slowed{
      towards_first(beyond.linear, before.linear_velocity_m_s, body.linear),
      towards_first(beyond.angular, before.angular_velocity_rad_s, body.angular)};
  PositionCorrection pushed{beyond.linear - slowed.linear, beyond.angular - slowed.angular};
  const PositionCorrection whole = pushed;
  limit_correction(most, pushed);
  return {beyond.linear + (pushed.linear - whole.linear),
          beyond.angular + (pushed.angular - whole.angular)};
}

namespace {

// By how much an overlap has grown at most, in sizes of the smaller body.
double overlap_growth(const ContactProblem& problem, const Substeps& substeps) {
  double growth = 0.0;
  for (std::size_t i = 0; i < problem.normals.size(); ++i) {
    const RowContact& contact = problem.contacts[i];
    const double gap = gap_m(problem, i, substeps.displacements);
    const double grown = std::min(contact.separation_m, 0.0) - gap;
    if (gap < 0.0) growth = std::max(growth, grown / contact.size_m);
  }
  return growth;
}

}  // namespace

std::uint32_t next_count(const ContactProblem& problem, const Substeps& substeps,
                         double most_growth, std::uint32_t most) {
  const double growth = overlap_growth(problem, substeps);
  if (growth <= most_growth) return substeps.count;
  const double times = std::max(2.0, std::ceil(std::sqrt(growth / most_growth)));
  return static_cast<std::uint32_t>(std::min<double>(most, times * substeps.count));
}

namespace {

void iterate_substeps(const Blows& blows, std::span<const SolverBody> free, ContactProblem& problem,
                      Substeps& substeps, SubstepWork& work) {
  work.iterations += 2 * substeps.count;
  for (std::uint32_t i = 0; i < substeps.count; ++i) {
    if (i > 0) go_on(problem, substeps);
    carry(i * substeps.length_s, substeps.length_s, problem);
    if (i == 0) start_with_blow(blows, free, problem, substeps, work.blows);
    press(problem, substeps);
    move_on(problem, substeps);
    share_blow(blows, problem, substeps, work.blows);
    relax(problem, substeps);
  }
}

}  // namespace

SubstepWork solve_in_substeps(const SolveStep& step, std::span<const SolverBody> free,
                              ContactProblem& problem, std::vector<PositionCorrection>& push) {
  const auto& [scene, dt_s, ids, states] = step;
  Substeps substeps;
  const std::uint32_t most = kMostTimesSubsteps * substeps_of(scene.solver);
  std::uint32_t count = substeps_under_load(step);
  const Blows blows = find_blows(step, problem);
  SubstepWork work;
  const ContactProblem start = problem;
  for (;;) {
    begin_substeps(dt_s, count, states, problem, substeps);
    iterate_substeps(blows, free, problem, substeps, work);
    count = next_count(problem, substeps, kMostGrowth, most);
    if (count == substeps.count) break;
    problem = start;
    work.blows.shared = work.blows.left = 0;  // its work counts, and what it did does not
  }
  end_substeps(problem, substeps);
  carry(0.0, dt_s, problem);
  clamp_gain(step, free, problem);
  const Flights flights = find_flights(problem);
  const FastestCorrection fastest = fastest_correction(scene, ids);
  push.resize(states.size());
  for (std::size_t i = 0; i < states.size(); ++i)
    push[i] = beyond_final_velocity(dt_s, fastest, states[i], problem.bodies[i], flights[i],
                                    substeps.displacements[i]);
  return work;
}

}  // namespace soda::physics
