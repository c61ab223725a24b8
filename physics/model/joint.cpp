#include "physics/model/joint.hpp"

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {
namespace {

ContactManifold manifold_of(const SceneDescription& scene, std::uint32_t index) {
  const Joint& joint = scene.joints[index];
  ContactManifold manifold;
  manifold.a = joint.a;
  manifold.b = joint.b;
  manifold.part = kFirstJointPart + index;
  return manifold;
}

std::span<const Joint> joints_between(const SceneDescription& scene, BodyId a, BodyId b) {
  if (scene.bodies[index_of(a)].joints == 0) return {};
  if (b != kWorldBody && scene.bodies[index_of(b)].joints == 0) return {};
  const auto key = [](const Joint& joint) { return std::pair(joint.a, joint.b); };
  const auto first = std::ranges::lower_bound(scene.joints, std::pair(a, b), {}, key);
  auto end = first;
  while (end != scene.joints.end() && key(*end) == std::pair(a, b)) ++end;
  return {first, end};
}

}  // namespace

bool is_joint(const ContactManifold& manifold) { return manifold.part >= kFirstJointPart; }

std::uint32_t joint_of(const ContactManifold& manifold) { return manifold.part - kFirstJointPart; }

void order_joints(SceneDescription& scene) {
  std::sort(scene.joints.begin(), scene.joints.end(), [](const Joint& x, const Joint& y) {
    return std::tie(x.a, x.b, x.label) < std::tie(y.a, y.b, y.label);
  });
  for (BodyParams& body : scene.bodies) body.joints = body.lasting_joints = 0;
  scene.has_world_joints = false;
  const auto count = [&scene](const Joint& joint, BodyId id) {
    BodyParams& body = scene.bodies[index_of(id)];
    ++body.joints;
    body.lasting_joints += can_break(joint) ? 0 : 1;
  };
  for (const Joint& joint : scene.joints) {
    count(joint, joint.a);
    if (joint.b == kWorldBody)
      scene.has_world_joints = true;
    else
      count(joint, joint.b);
  }
}

bool is_broken(const Joint& joint, const BodyState& state) {
  return std::ranges::binary_search(state.broken_joints, joint.label);
}

void append_joints(const SceneDescription& scene, BodyId a, const BodyState& lower, BodyId b,
                   std::vector<ContactManifold>& out) {
  for (const Joint& joint : joints_between(scene, a, b))
    if (!is_broken(joint, lower))
      out.push_back(manifold_of(scene, static_cast<std::uint32_t>(&joint - scene.joints.data())));
}

bool may_touch_unheld(const SceneDescription& scene, BodyId a, BodyId b) {
  if (!groups_touch(scene, a, b)) return false;
  return falls(scene, a) || falls(scene, b);  // else nothing could keep them apart
}

bool may_touch(const SceneDescription& scene, BodyId a, const BodyState& lower, BodyId b) {
  if (!may_touch_unheld(scene, a, b)) return false;
  return is_static(b) ||
         std::ranges::all_of(joints_between(scene, a, b), [&lower](const Joint& joint) {
           return joint.collides || is_broken(joint, lower);
         });
}

void append_world_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                         std::span<const BodyState> states,
                         std::vector<ContactManifold>& manifolds) {
  if (!scene.has_world_joints) return;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (scene.bodies[index_of(ids[i])].joints == 0) continue;
    append_joints(scene, ids[i], states[i], kWorldBody, manifolds);
  }
  std::sort(manifolds.begin(), manifolds.end(), canonical_before);
}

}  // namespace soda::physics
