#include "physics/events/one_solve.hpp"

#include <algorithm>

#include "physics/events/event_driven_impacts.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/refinement/advance_apart.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/solvers/solve_choice.hpp"

namespace soda::physics {

namespace {

// Of what is left where contacts that hold nothing are taken away, if that is more than one.
bool has_large_part(const IslandStep& island, std::span<const BodyState> states) {
  std::vector<ContactManifold> kept;
  const Islands parts = islands_apart(island, states, kept);
  if (parts.count() + parts.free_bodies.size() < 2) return true;
  for (std::size_t i = 0; i < parts.count(); ++i) {
    std::vector<ContactManifold> of_part;
    for (std::uint32_t m = parts.manifold_begin[i]; m < parts.manifold_begin[i + 1]; ++m)
      of_part.push_back(kept[parts.manifolds[m]]);
    if (is_large(of_part)) return true;
  }
  return false;
}

}  // namespace

bool is_one_solve(const IslandStep& island, std::span<const BodyState> states) {
  const SceneDescription& scene = island.scene;
  return scene.solver.contact_response && !(scene.tolerance > 0.0) &&
         !is_in_flight(island, states) &&
         !(is_affordable(scene, island.manifolds) && gains_by_refinement(island, states)) &&
         (!is_large(island.manifolds) || has_large_part(island, states));
}

std::optional<IslandBlocks> blocks_of_step(const IslandStep& island,
                                           std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (!is_large(manifolds) || !is_one_solve(island, states)) return std::nullopt;
  if (!scene.joints.empty())
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (!is_unjointed(scene.bodies[index_of(ids[i])], states[i])) return std::nullopt;
  return choose_solve(scene, dt_s, false, ids, manifolds, states).blocks;
}

}  // namespace soda::physics
