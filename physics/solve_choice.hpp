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

// Of one solve over dt_s (advance_once). What joints hold is never solved by contacts alone, so a
// body that has any has neither, be its joints among the manifolds or lost. A function of the
// island's content.
SolveChoice choose_solve(const SceneDescription& scene, double dt_s, bool accurate,
                         std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states);

// Whether the whole step of an island that is giant is one such solve over the scene's dt_s, not
// accurate: nothing flies through impacts, and nothing is refined.
bool is_one_solve(const SceneDescription& scene, const Geometry& geometry,
                  std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                  std::span<const BodyState> states);

// The blocks in which advance_island solves an island, if it does. Only giant islands have any.
std::optional<IslandBlocks> blocks_of_step(const SceneDescription& scene, const Geometry& geometry,
                                           std::span<const BodyId> ids,
                                           std::span<const ContactManifold> manifolds,
                                           std::span<const BodyState> states);

}  // namespace soda::physics
