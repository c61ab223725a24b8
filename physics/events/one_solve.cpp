#include "physics/events/one_solve.hpp"

#include <algorithm>

#include "physics/events/impacts.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/solvers/solve_choice.hpp"

namespace soda::physics {

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
  const auto unjointed = [&](BodyId id) { return is_unjointed(scene.bodies[index_of(id)]); };
  if (!scene.joints.empty() && !std::ranges::all_of(ids, unjointed)) return std::nullopt;
  return choose_solve(scene, scene.dt_s, false, ids, manifolds, states).blocks;
}

}  // namespace soda::physics
