#include "physics/contact_choice.hpp"

#include <optional>

#include "physics/direct_contacts.hpp"

namespace soda::physics {
namespace {

// Whether the sweeps converged.
bool sweep(const SceneDescription& scene, ContactProblem& problem, ContactSolution& solution) {
  const int most = scene.solver.iterations;
  int sweeps = solve_velocities(most, problem);
  bool converged = sweeps < most;
  if (problem.restitution_rows > 0 && aim_rebounds(problem)) {
    const int more = solve_velocities(most, problem);
    converged = more < most;
    sweeps += more;
  }
  solution.iterations += static_cast<std::uint32_t>(sweeps);
  return converged;
}

void count(const NewtonOutcome& outcome, const Elimination& plan, ContactSolution& solution) {
  solution.iterations += static_cast<std::uint32_t>(outcome.steps);
  solution.multiplications +=
      static_cast<std::uint64_t>(outcome.factorisations * plan.multiplications);
}

// Whether Newton's method converged. The problem stays as it was where it did not.
bool solve_by_newton(std::span<const SolverBody> free, const Elimination& plan,
                     ContactProblem& problem, ContactSolution& solution) {
  const NewtonOutcome outcome = solve_directly(free, plan, problem);
  count(outcome, plan, solution);
  return outcome.converged;
}

}  // namespace

ContactSolution solve_contacts(const SceneDescription& scene, std::span<const BodyState> states,
                               std::span<const SolverBody> free, ContactProblem& problem) {
  constexpr std::size_t kFew = 2;
  ContactSolution solution;
  std::optional<Elimination> plan;
  if (!scene.solver.direct) {
    sweep(scene, problem, solution);
  } else if (states.size() <= kFew) {
    ContactProblem start = problem;
    if (!sweep(scene, problem, solution)) {
      plan = plan_direct_solve(scene, states, start);
      solution.direct = plan && solve_by_newton(free, *plan, start, solution);
      if (solution.direct) problem = std::move(start);
    }
  } else {
    plan = plan_direct_solve(scene, states, problem);
    solution.direct = plan && solve_by_newton(free, *plan, problem, solution);
    if (!solution.direct) sweep(scene, problem, solution);
  }
  if (!needs_push_out(problem)) return solution;
  if (solution.direct) {
    const NewtonOutcome outcome = push_out_directly(scene.dt_s, *plan, problem, solution.push);
    count(outcome, *plan, solution);
    if (outcome.converged) return solution;
  }
  solve_push_out(scene.solver.iterations, scene.dt_s, problem, solution.push);
  return solution;
}

}  // namespace soda::physics
