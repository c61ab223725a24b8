#include "physics/model/joint.hpp"

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>

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
  const auto key = [](const Joint& joint) { return std::pair(joint.a, joint.b); };
  return {std::ranges::lower_bound(scene.joints, std::pair(a, b), {}, key),
          std::ranges::upper_bound(scene.joints, std::pair(a, b), {}, key)};
}

}  // namespace

bool is_joint(const ContactManifold& manifold) { return manifold.part >= kFirstJointPart; }

std::uint32_t joint_of(const ContactManifold& manifold) { return manifold.part - kFirstJointPart; }

void order_joints(SceneDescription& scene) {
  std::sort(scene.joints.begin(), scene.joints.end(), [](const Joint& x, const Joint& y) {
    return std::tie(x.a, x.b, x.label) < std::tie(y.a, y.b, y.label);
  });
  for (BodyParams& body : scene.bodies) body.joints = 0;
  scene.has_world_joints = false;
  for (const Joint& joint : scene.joints) {
    ++scene.bodies[index_of(joint.a)].joints;
    if (joint.b == kWorldBody)
      scene.has_world_joints = true;
    else
      ++scene.bodies[index_of(joint.b)].joints;
  }
}

void append_joints(const SceneDescription& scene, BodyId a, BodyId b,
                   std::vector<ContactManifold>& out) {
  for (const Joint& joint : joints_between(scene, a, b))
    out.push_back(manifold_of(scene, static_cast<std::uint32_t>(&joint - scene.joints.data())));
}

bool may_touch(const SceneDescription& scene, BodyId a, BodyId b) {
  if (!groups_touch(scene, a, b)) return false;
  if (!falls(scene, a) && !falls(scene, b)) return false;  // nothing could keep them apart
  return is_static(b) || std::ranges::all_of(joints_between(scene, a, b), &Joint::collides);
}

void append_world_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                         std::vector<ContactManifold>& manifolds) {
  if (!scene.has_world_joints) return;
  for (const BodyId id : ids) {
    if (scene.bodies[index_of(id)].joints == 0) continue;
    append_joints(scene, id, kWorldBody, manifolds);
  }
  std::sort(manifolds.begin(), manifolds.end(), canonical_before);
}

}  // namespace soda::physics
