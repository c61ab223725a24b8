#include "physics/constraints/joint_islands.hpp"

#include <algorithm>

#include "physics/broadphase/islands.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/model/contact_manifold.hpp"

namespace soda::physics {
namespace {

std::vector<ContactManifold> joint_manifolds(const SceneDescription& scene,
                                             std::span<const BodyId> ids) {
  std::vector<ContactManifold> manifolds;
  const std::vector<BodyState> whole(ids.size());
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    if (is_static(joint.b)) continue;
    const bool again =
        i > 0 && scene.joints[i - 1].a == joint.a && scene.joints[i - 1].b == joint.b;
    if (!again) append_joints(scene, joint.a, {}, joint.b, manifolds);
  }
  append_world_joints(scene, ids, whole, manifolds);
  return manifolds;
}

// Multiplications of a factorisation. More are not counted.
constexpr double kMost = 1e9;

// How many rows there are, and in which order they are eliminated, does not depend on poses.
JointIsland island_of(const SceneDescription& scene, std::vector<BodyId> bodies,
                      std::span<const ContactManifold> manifolds) {
  JointSystem system = find_joints(scene, bodies, manifolds);
  const std::vector<BodyState> anywhere(bodies.size());
  build_joint_rows(scene, scene.dt_s, anywhere, true, system);
  return {std::move(bodies), static_cast<std::uint32_t>(system.joints.size()),
          static_cast<std::uint32_t>(system.rows.size()),
          static_cast<std::uint64_t>(std::min(kMost, factor_multiplications(kMost, system)))};
}

}  // namespace

std::vector<JointIsland> joint_islands(const SceneDescription& scene) {
  std::vector<JointIsland> found;
  if (scene.joints.empty()) return found;
  std::vector<BodyId> ids;
  for (std::uint32_t body = 0; body < scene.bodies.size(); ++body) ids.push_back(BodyId{body});
  const std::vector<ContactManifold> manifolds = joint_manifolds(scene, ids);
  Islands islands;
  build_islands(ids, manifolds, islands);
  for (std::size_t island = 0; island < islands.count(); ++island) {
    std::vector<BodyId> bodies;
    for (std::uint32_t i = islands.body_begin[island]; i < islands.body_begin[island + 1]; ++i)
      bodies.push_back(ids[islands.bodies[i]]);
    std::vector<ContactManifold> own;
    for (std::uint32_t i = islands.manifold_begin[island]; i < islands.manifold_begin[island + 1];
         ++i)
      own.push_back(manifolds[islands.manifolds[i]]);
    found.push_back(island_of(scene, std::move(bodies), own));
  }
  return found;
}

}  // namespace soda::physics
