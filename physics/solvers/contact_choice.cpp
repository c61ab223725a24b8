#include "physics/solvers/contact_choice.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/substeps.hpp"

namespace soda::physics {
namespace {

// The share of all start impulses that makes least what every solver here makes least,
// 1/2 impulses W impulses + impulses (velocity without contacts - target).
double best_share_of_start(std::span<const SolverBody> free, const ContactProblem& problem) {
  double square = 0.0, product = 0.0;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const SolverBody& body = problem.bodies[i];
    if (body.inverse_mass == 0.0) continue;
    const Mat3 inertia = inverse_of_symmetric(body.inverse_inertia);
    const Vec3 linear = body.linear - free[i].linear, angular = body.angular - free[i].angular;
    const Vec3 momentum = linear * (1.0 / body.inverse_mass), angular_momentum(inertia * angular);
    square += momentum.dot(linear) + angular_momentum.dot(angular);
    product += momentum.dot(free[i].linear) + angular_momentum.dot(free[i].angular);
  }
  for (const NormalRow& row : problem.normals) product -= row.impulse_newton_s * row.target_m_s;
  product -= kinematic_work_joule(free, problem);
  for (const FrictionRow& row : problem.frictions) {
    if (row.b == problem.normals[row.normal_row].b) continue;
    const Vec3& surface = problem.bodies[row.b].linear;
    for (int t = 0; t < 2; ++t) product += row.impulse_newton_s[t] * row.tangent[t].dot(surface);
  }
  return square > 0.0 ? -product / square : 1.0;
}

// Impulses of the step before, of the wrong size, throw away what is that much lighter.
constexpr double kMuchLighter = 100.0;

// Those of a hard impact are far too large in the step after it. Iterations get rid of them, unless
// they act on bodies that are much lighter than others.
void drop_bad_start(double mass_ratio, std::span<const SolverBody> free, ContactProblem& problem) {
  constexpr double kLeastShare = 0.1;
  if (mass_ratio <= kMuchLighter) return;
  if (best_share_of_start(free, problem) >= kLeastShare) return;
  std::copy(free.begin(), free.end(), problem.bodies.begin());
  forget_impulses(problem);
}

// What bounces wants its rebounds exactly, one body or two are solved exactly by iterations. Where
// rounding is asked for, rolling friction gets it by iterations alone.
bool wants_substeps(bool accurate, std::size_t bodies, const ContactProblem& problem) {
  if (accurate && !problem.rollings.empty()) return false;
  return bodies > 2 && problem.restitution_rows == 0;
}

// Newton's method, for half the work of the iterations that have not converged. Whether it does;
// the problem stays as it was where not.
bool finish_by_newton(int iterations, const SolveStep& step, std::span<const SolverBody> free,
                      ContactProblem& problem, ContactSolution& solution) {
  constexpr double kOfRow = 8.0, kAnyway = 1e4;  // multiplications; an iteration takes 16 a row
  constexpr double kFactorisations = 6.0;        // fewer lead nowhere
  if (!step.scene.solver.direct) return false;
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (const NormalRow& row : problem.normals)
    if (row.b < free.size()) edges.push_back({row.a, row.b});
  const double most =
      std::max(kAnyway, kOfRow * iterations * static_cast<double>(rows_of(problem)));
  const std::optional<Elimination> plan =
      plan_elimination(static_cast<std::uint32_t>(free.size()), edges, most / kFactorisations);
  if (!plan) return false;
  // To rounding, so that what rests comes to rest.
  const DirectAim aim{.wanted = 1e-15,
                      .rounding = 1e-10,
                      .accepted = 1e-7,
                      .factorisations = static_cast<int>(most / plan->multiplications)};
  const NewtonOutcome outcome = solve_directly(aim, free, *plan, problem);
  count(outcome, *plan, solution);
  return outcome.converged;
}

// What iterations leave is finished by Newton's method where that is little work. In a long step
// the last of a speed is a long way: iterations over few rows go on until it is short.
void solve_until_close(int most, const SolveStep& step, std::span<const SolverBody> free,
                       ContactProblem& problem, ContactSolution& solution) {
  constexpr std::size_t kFewRows = 16;
  constexpr double kShort = 1e-4, kExact = 1e-12;  // of the smaller body
  constexpr int kMostRounds = 20;
  double size_m = problem.contacts.empty() ? 0.0 : problem.contacts[0].size_m;
  for (const RowContact& contact : problem.contacts) size_m = std::min(size_m, contact.size_m);
  for (int round = 0; round < kMostRounds; ++round) {
    const int iterations = solve_velocities(most, problem);
    solution.iterations += static_cast<std::uint32_t>(iterations);
    if (iterations < most) return;
    const double left_m = residual_m_s(problem) * step.dt_s;
    if (round == 0 && left_m > kExact * size_m &&
        finish_by_newton(most, step, free, problem, solution))
      return;
    if (problem.normals.size() > kFewRows || !(left_m > kShort * size_m)) return;
  }
}

// Whether Newton's method converged. The problem stays as it was where it did not.
bool solve_by_newton(const DirectAim& aim, std::span<const SolverBody> free,
                     const Elimination& plan, ContactProblem& problem, ContactSolution& solution) {
  const NewtonOutcome outcome = solve_directly(aim, free, plan, problem);
  count(outcome, plan, solution);
  if (outcome.converged) clamp_work(free, problem);
  return outcome.converged;
}

// What does not come to rest by few factorisations takes far longer than other steps. A pile of
// which one body still rocks is solved to a share of that body's speed.
DirectAim ongoing(const SceneDescription& scene) {
  constexpr int kInHaste = 20;
  DirectAim aim = kOngoing;
  aim.of_motion = kOfMotion;
  if (!scene.solver.refined) aim.factorisations = kInHaste;
  return aim;
}

// The same for an impact: first as if nothing bounced, then with the rebounds of what was hit.
bool bounce_by_newton(const SolveStep& step, std::span<const SolverBody> free,
                      const Elimination& plan, ContactProblem& problem, ContactSolution& solution) {
  const ContactProblem start = problem;
  if (!solve_by_newton(kByItself, free, plan, problem, solution)) return false;
  if (problem.restitution_rows == 0) return true;
  const SolvedContacts plastic = solved_contacts(problem);
  if (!set_restitution_targets(problem)) return true;
  const NewtonOutcome outcome = solve_directly(kByItself, free, plan, problem);
  count(outcome, plan, solution);
  if (outcome.converged)
    clamp_rebounds(step, free, plastic, problem);
  else
    problem = start;
  return outcome.converged;
}

void iterate_with_rebounds(int most, const SolveStep& step, std::span<const SolverBody> free,
                           ContactProblem& problem, ContactSolution& solution) {
  const double dt_s = step.dt_s;
  solve_until_close(most, step, free, problem, solution);
  clamp_work(free, problem);
  if (problem.restitution_rows > 0) {
    const SolvedContacts plastic = solved_contacts(problem);
    if (set_restitution_targets(problem)) {
      solve_until_close(most, step, free, problem, solution);
      clamp_rebounds(step, free, plastic, problem);
    }
  }
  if (dt_s > 0.0 && aim_to_close(dt_s, problem)) {
    solve_until_close(most, step, free, problem, solution);
    clamp_work(free, problem);
  }
}

ContactSolution solve_with_surfaces(const SolveStep& step, bool accurate,
                                    std::span<const SolverBody> free, const Elimination* plan,
                                    ContactProblem& problem) {
  const auto& [scene, dt_s, ids, before] = step;
  // Then iterations end where they change nothing any more.
  constexpr int kIterationsIfAccurate = 1000;
  ContactSolution solution;
  const double ratio = mass_ratio(scene, ids);
  drop_bad_start(ratio, free, problem);
  if (plan != nullptr && problem.restitution_rows == 0) {
    solution.direct =
        solve_by_newton(accurate ? kByItself : ongoing(scene), free, *plan, problem, solution);
    // Between very unequal masses, what rounding leaves is better than what iterations find.
    if (!solution.direct && accurate && ratio > kMuchLighter)
      solution.direct = solve_by_newton(kOngoing, free, *plan, problem, solution);
  }
  if (!solution.direct && wants_substeps(accurate, ids.size(), problem)) {
    const SubstepWork work = solve_in_substeps(step, free, problem, solution.push);
    solution.iterations += work.iterations;
    solution.multiplications += work.blows.multiplications;
    solution.blows = work.blows.shared;
    solution.blows_left = work.blows.left;
    return solution;
  }
  if (!solution.direct)
    iterate_with_rebounds(accurate ? kIterationsIfAccurate : scene.solver.iterations, step, free,
                          problem, solution);
  if (!needs_position_correction(problem)) return solution;
  if (solution.direct) {
    const NewtonOutcome outcome = correct_positions_directly(dt_s, *plan, problem, solution.push);
    count(outcome, *plan, solution);
    if (outcome.converged) {
      limit_correction(fastest_correction(scene, ids), solution.push);
      return solution;
    }
  }
  PositionCorrectionProblem push;
  solve_position_correction(scene.solver.iterations, dt_s, problem, push);
  solution.push = std::move(push.bodies);
  limit_correction(fastest_correction(scene, ids), solution.push);
  return solution;
}

// Where surfaces that move would make bodies too fast, in wedges that pressure locks, they stand.
template <class Solve>
auto solve_driven(std::span<const SolverBody> free, ContactProblem& problem, const Solve& solve) {
  if (problem.moving_surfaces.empty()) return solve();
  const ContactProblem start = problem;
  auto solved = solve();
  StepWork work;
  add_driven(free, problem, work);
  if (!is_too_fast(work.driven)) return solved;
  problem = start;
  for (std::size_t i = free.size() + 1; i < problem.bodies.size(); ++i)
    problem.bodies[i].linear = Vec3::Zero();
  return solve();
}

}  // namespace

void count(const NewtonOutcome& outcome, const Elimination& plan, ContactSolution& solution) {
  solution.iterations += static_cast<std::uint32_t>(outcome.steps);
  solution.multiplications +=
      static_cast<std::uint64_t>(outcome.factorisations * plan.multiplications);
}

ContactSolution solve_impact(int most, const SolveStep& step, std::span<const SolverBody> free,
                             const Elimination* plan, ContactProblem& problem) {
  return solve_driven(free, problem, [&] {
    ContactSolution solution;
    solution.direct = plan != nullptr && bounce_by_newton(step, free, *plan, problem, solution);
    if (!solution.direct) iterate_with_rebounds(most, step, free, problem, solution);
    return solution;
  });
}

ContactSolution solve_contacts(const SolveStep& step, bool accurate,
                               std::span<const SolverBody> free, const Elimination* plan,
                               ContactProblem& problem) {
  return solve_driven(free, problem,
                      [&] { return solve_with_surfaces(step, accurate, free, plan, problem); });
}

}  // namespace soda::physics
