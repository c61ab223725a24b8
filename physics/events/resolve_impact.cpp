#include "physics/events/resolve_impact.hpp"

#include <optional>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/solvers/contact_choice.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {

bool resolve_impact(const SceneDescription& scene, std::span<const BodyId> ids,
                    std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                    IslandReport& report, StageCounters& counters) {
  constexpr int kMostIterations = 300;
  std::vector<BodyState> start(states.begin(), states.end());
  for (BodyState& state : start) state.impulses.clear();
  const IndexedSpan<BodyState> before{std::span<const BodyState>(start)};
  ContactProblem problem;
  const SolveStep impact{scene, 0.0, ids, before};
  load_bodies(impact, problem.bodies, counters);
  const std::vector<SolverBody> free(problem.bodies.begin(), problem.bodies.end() - 1);
  build_rows(impact, manifolds, problem, counters);
  const std::optional<Elimination> plan = plan_impact_solve(scene, ids, manifolds);
  const ContactSolution solution =
      solve_impact(kMostIterations, impact, free, plan ? &*plan : nullptr, problem);
  report.iterations += solution.iterations;
  counters.solver_iterations += solution.iterations;
  counters.row_sweeps += solution.iterations * rows_of(problem);
  counters.factor_multiplications += solution.multiplications;
  report_contacts(before, problem, report);
  bool changed = false;
  for (std::size_t i = 0; i < states.size(); ++i) {
    changed = changed || problem.bodies[i].linear != states[i].linear_velocity_m_s ||
              problem.bodies[i].angular != states[i].angular_velocity_rad_s;
    states[i].linear_velocity_m_s = problem.bodies[i].linear;
    states[i].angular_velocity_rad_s = problem.bodies[i].angular;
  }
  ++counters.impacts;
  return changed;
}

}  // namespace soda::physics
