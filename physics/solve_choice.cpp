#include "physics/solve_choice.hpp"

#include <algorithm>

#include "physics/direct_contacts.hpp"
#include "physics/impacts.hpp"
#include "physics/refinement.hpp"

namespace soda::physics {

SolveChoice choose_solve(const SceneDescription& scene, double dt_s, bool accurate,
                         std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states) {
  SolveChoice choice;
  if (!scene.joints.empty() &&
      std::ranges::any_of(ids, [&](BodyId id) { return scene.bodies[index_of(id)].joints > 0; }))
    return choice;
  choice.elimination = plan_direct_solve(scene, dt_s, accurate, ids, manifolds, states);
  if (choice.elimination || !is_giant(manifolds)) return choice;
  IslandBlocks blocks = split_island(ids, manifolds);
  if (blocks.count() > 1) choice.blocks = std::move(blocks);
  return choice;
}

bool is_one_solve(const SceneDescription& scene, const Geometry& geometry,
                  std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                  std::span<const BodyState> states) {
  return scene.solver.contact_response && !(scene.tolerance > 0.0) &&
         !is_in_flight(scene, geometry, ids, manifolds, states) &&
         !is_refined(scene, geometry, ids, manifolds);
}

std::optional<IslandBlocks> blocks_of_step(const SceneDescription& scene, const Geometry& geometry,
                                           std::span<const BodyId> ids,
                                           std::span<const ContactManifold> manifolds,
                                           std::span<const BodyState> states) {
  if (!is_giant(manifolds) || !is_one_solve(scene, geometry, ids, manifolds, states))
    return std::nullopt;
  return choose_solve(scene, scene.dt_s, false, ids, manifolds, states).blocks;
}

}  // namespace soda::physics
