#include "physics/events/one_solve.hpp"

#include <algorithm>

#include "physics/events/impacts.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/refinement/advance_apart.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/solvers/solve_choice.hpp"

namespace soda::physics {

namespace {

// Of what is left where contacts that hold nothing are taken away, if that is more than one.
bool has_giant_part(const SceneDescription& scene, const Geometry& geometry,
                    std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                    std::span<const BodyState> states) {
  std::vector<ContactManifold> kept;
  const Islands parts = islands_apart(scene, geometry, scene.dt_s, ids, manifolds, states, kept);
  if (parts.count() + parts.free_bodies.size() < 2) return true;
  for (std::size_t i = 0; i < parts.count(); ++i) {
    std::vector<ContactManifold> of_part;
    for (std::uint32_t m = parts.manifold_begin[i]; m < parts.manifold_begin[i + 1]; ++m)
      of_part.push_back(kept[parts.manifolds[m]]);
    if (is_giant(of_part)) return true;
  }
  return false;
}

}  // namespace

bool is_one_solve(const SceneDescription& scene, const Geometry& geometry,
                  std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                  std::span<const BodyState> states) {
  return scene.solver.contact_response && !(scene.tolerance > 0.0) &&
         !is_in_flight(scene, geometry, ids, manifolds, states) &&
         !(is_affordable(scene, manifolds) &&
           gains_by_refinement(scene, geometry, ids, manifolds, states)) &&
         (!is_giant(manifolds) || has_giant_part(scene, geometry, ids, manifolds, states));
}

std::optional<IslandBlocks> blocks_of_step(const SceneDescription& scene, const Geometry& geometry,
                                           std::span<const BodyId> ids,
                                           std::span<const ContactManifold> manifolds,
                                           std::span<const BodyState> states) {
  if (!is_giant(manifolds) || !is_one_solve(scene, geometry, ids, manifolds, states))
    return std::nullopt;
  if (!scene.joints.empty())
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (!is_unjointed(scene.bodies[index_of(ids[i])], states[i])) return std::nullopt;
  return choose_solve(scene, scene.dt_s, false, ids, manifolds, states).blocks;
}

}  // namespace soda::physics
