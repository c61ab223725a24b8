// Which way an island's step is solved: the one place where it is decided between a direct solve,
// blocks and iterations over the whole. Whoever divides an island between solvers asks here, too.
#pragma once

#include <optional>
#include <span>

#include "physics/constraints/joint_islands.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/math/block_cholesky.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/geometry.hpp"
#include "physics/solvers/island_blocks.hpp"

namespace soda::physics {

Need direct_solves_needed(const SceneDescription& scene);
Need blocks_needed(const SceneDescription& scene);
Need joint_iterations_needed(const SceneDescription& scene);

// One of both at most. Neither: the whole by iterations, in turns with its joints if it has any.
struct SolveChoice {
  std::optional<Elimination> elimination;  // directly (direct_contacts.hpp)
  std::optional<IslandBlocks> blocks;      // two or more (split_solver.hpp)
};

// Of one solve over dt_s (advance_once) of these manifolds: what a joint among them holds is solved
// by none of both. (Explicit springs, explicit_springs.hpp, are not among them.) A function of the
// island's content.
SolveChoice choose_solve(const SceneDescription& scene, double dt_s, bool accurate,
                         std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states);

// Whether an island that joints alone hold is swept: known before a run.
bool are_joints_swept(const SceneDescription& scene, const JointIsland& island);

// Of an island with joints. Swept: joints and contacts together (swept_joints.hpp), where that is
// less work than what `quality` lets a direct solution take; never to a tolerance, or where
// `accurate`. Else the joints directly, and contacts by Newton's method with them if there is an
// elimination.
struct JointedChoice {
  std::optional<Elimination> elimination;
  bool swept = false;
  bool swept_else = false;     // where Newton's method does not converge
  std::uint32_t substeps = 1;  // if swept
};
JointedChoice choose_jointed_solve(const IslandStep& island, bool accurate,
                                   std::span<const BodyState> states, JointSystem& joints);

}  // namespace soda::physics
