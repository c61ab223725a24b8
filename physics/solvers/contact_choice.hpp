// Which solver an island's contacts get, and what it did.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/math/block_cholesky.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/scene.hpp"
#include "physics/solvers/newton_solver.hpp"

namespace soda::physics {

struct ContactSolution {
  bool direct = false;                      // by Newton's method; by iterations otherwise
  std::uint32_t iterations = 0;             // and steps of Newton's method
  std::uint64_t multiplications = 0;        // of all factorisations, roughly
  std::uint32_t blows = 0, blows_left = 0;  // shared out, left to iterations (blows.hpp)
  std::vector<PositionCorrection> push;     // see solve_position_correction
};

// Adds what a solution by Newton's method took.
void count(const NewtonOutcome& outcome, const Elimination& plan, ContactSolution& solution);

// At one moment, with rebounds; the contacts give no energy. What touches is all there is. By
// Newton's method if there is a plan and it converges, by iterations otherwise: `most` at a time.
// `free` as below.
ContactSolution solve_impact(int most, const SolveStep& step, std::span<const SolverBody> free,
                             const Elimination* plan, ContactProblem& problem);

// Solves the rows of one island, whose bodies have the velocities `free` after external forces.
// Directly if there is a plan (plan_direct_solve), nothing bounces and it converges, by iterations
// otherwise. The contacts give the island no energy (energy_clamp.hpp); surfaces that move stand
// where they would make bodies too fast (Driven). The choice depends on nothing but the island's
// content.
ContactSolution solve_contacts(const SolveStep& step, bool accurate,
                               std::span<const SolverBody> free, const Elimination* plan,
                               ContactProblem& problem);

}  // namespace soda::physics
