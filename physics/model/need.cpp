#include "physics/model/need.hpp"

#include <cstdint>
#include <optional>
#include <utility>

namespace soda::physics {
namespace {

// Pairs with a joint that keeps them from touching; joints are in their order.
std::uint64_t pairs_apart(const SceneDescription& scene) {
  std::uint64_t pairs = 0;
  std::optional<std::pair<BodyId, BodyId>> last;
  for (const Joint& joint : scene.joints) {
    if (joint.collides || can_break(joint) || is_static(joint.b)) continue;
    if (last == std::pair(joint.a, joint.b)) continue;
    last = std::pair(joint.a, joint.b);
    ++pairs;
  }
  return pairs;
}

bool can_touch(const SceneDescription& scene) {
  const std::uint64_t bodies = scene.bodies.size();
  if (bodies == 0) return false;
  return !scene.statics.empty() || bodies * (bodies - 1) / 2 > pairs_apart(scene);
}

}  // namespace

std::size_t solid_statics(const SceneDescription& scene) {
  return statics_that(scene, [&scene](const StaticBody& fixed) {
    return !std::holds_alternative<TriangleMesh>(scene.shapes[fixed.shape]);
  });
}

Need contacts_needed(const SceneDescription& scene) {
  if (!can_touch(scene)) return {false, "nothing can touch"};
  return need_of(scene.solver.contact_response, "contacts push back",
                 "detection only: contacts have no response");
}

}  // namespace soda::physics
