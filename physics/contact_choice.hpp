// Which solver an island's contacts get, and what it did.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact_manifold.hpp"
#include "physics/contact_solver.hpp"
#include "physics/scene.hpp"

namespace soda::physics {

struct ContactSolution {
  bool direct = false;                // by Newton's method; by sweeps otherwise
  std::uint32_t iterations = 0;       // sweeps, and steps of Newton's method
  std::uint64_t multiplications = 0;  // of all factorisations, roughly
  std::vector<PushOut> push;          // see solve_push_out
};

// Whether an island without joints is giant, and none for the direct solver: then it is solved
// block by block (split_solver.hpp), unless it has one block only. A function of its content.
bool is_solved_in_blocks(const SceneDescription& scene, std::span<const BodyId> ids,
                         std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states);

// Solves the rows of one island, whose bodies start the step in `states` and have the velocities
// `free` after external forces. Directly where plan_direct_solve says so and it converges, by
// sweeps otherwise, and where it has one body or two of like masses. The choice depends on nothing
// but the island's content.
ContactSolution solve_contacts(const SceneDescription& scene, std::span<const BodyState> states,
                               std::span<const SolverBody> free, ContactProblem& problem);

}  // namespace soda::physics
