#include "physics/solvers/solve_choice.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "physics/model/kinematic.hpp"
#include "physics/solvers/direct_contacts.hpp"

namespace soda::physics {
namespace {

// Two blocks of two layers each.
constexpr std::size_t kLeastInBlocks = 4;

// Whether its bodies and statics can have that many contact points.
bool can_be_giant(const SceneDescription& scene) {
  constexpr std::size_t kPointsOfPair = std::tuple_size_v<decltype(ContactManifold::points)>;
  if (solid_statics(scene) < scene.statics.size()) return true;  // meshes have many manifolds
  const std::size_t bodies = scene.bodies.size();
  const std::size_t pairs = bodies * (bodies - 1) / 2 + bodies * scene.statics.size();
  return pairs * kPointsOfPair >= kGiantPoints;
}

}  // namespace

// One body alone is solved directly where joints hold it, too.
Need direct_solves_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  if (!scene.solver.direct) return {false, "switched off in the solver settings"};
  return need_of(scene.bodies.size() > 1 || !scene.joints.empty(),
                 "islands can be cheap to factorise", "one body alone is solved by sweeps");
}

Need blocks_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  if (scene.bodies.size() < kLeastInBlocks) return {false, "too few bodies for two blocks"};
  return need_of(can_be_giant(scene), "an island may have hundreds of contact points",
                 "no island can have so many contact points");
}

SolveChoice choose_solve(const SceneDescription& scene, double dt_s, bool accurate,
                         std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                         std::span<const BodyState> states) {
  SolveChoice choice;
  choice.elimination = plan_direct_solve(scene, dt_s, accurate, ids, manifolds, states);
  if (choice.elimination || !is_giant(manifolds)) return choice;
  if (!scene.joints.empty() && std::ranges::any_of(manifolds, is_joint)) return choice;
  if (any_kinematic(scene, ids)) return choice;
  IslandBlocks blocks = split_island(ids, manifolds);
  if (blocks.count() > 1) choice.blocks = std::move(blocks);
  return choice;
}

}  // namespace soda::physics
