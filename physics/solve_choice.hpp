// Which way an island's step is solved: the one place where it is decided between a direct solve,
// blocks and sweeps over the whole. Whoever divides an island between solvers asks here, too.
#pragma once

#include <optional>
#include <span>

#include "physics/block_cholesky.hpp"
#include "physics/contact_manifold.hpp"
#include "physics/geometry.hpp"
#include "physics/island_blocks.hpp"
#include "physics/need.hpp"
#include "physics/scene.hpp"

namespace soda::physics {

Need direct_solves_needed(const SceneDescription& scene);
Need blocks_needed(const SceneDescription& scene);

// One of both at most. Neither: the whole by sweeps, in turns with its joints if it has any.
struct SolveChoice {
  std::optional<Elimination> elimination;  // directly (direct_contacts.hpp)
  std::optional<IslandBlocks> blocks;      // two or more (split_solver.hpp)
};

// Of one solve over dt_s (advance_once) of these manifolds: what a joint among them holds is solved
// by none of both. (Springs that kick, spring_kicks.hpp, are not among them.) A function of the
// island's content.
SolveChoice choose_solve(const SceneDescription& scene, double dt_s, bool accurate,
                         std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states);

// Whether the whole step of an island that is giant is one such solve over the scene's dt_s, not
// accurate: nothing flies through impacts, and nothing is refined.
bool is_one_solve(const SceneDescription& scene, const Geometry& geometry,
                  std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                  std::span<const BodyState> states);

// The blocks in which advance_island solves an island, if it does. Only giant islands have any, and
// none whose bodies have joints: that one is lost is to be seen of the whole.
std::optional<IslandBlocks> blocks_of_step(const SceneDescription& scene, const Geometry& geometry,
                                           std::span<const BodyId> ids,
                                           std::span<const ContactManifold> manifolds,
                                           std::span<const BodyState> states);

}  // namespace soda::physics
