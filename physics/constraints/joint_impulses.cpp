#include "physics/constraints/joint_impulses.hpp"

#include <algorithm>
#include <array>

namespace soda::physics {
namespace {

bool is_angular(const JointRow& row) { return row.linear == Vec3::Zero(); }

}  // namespace

void load_joint_impulses(const SceneDescription& scene, std::span<const BodyState> states,
                         JointSystem& system) {
  for (std::size_t j = 0; j < system.joints.size(); ++j) {
    const BodyId other = scene.joints[system.joints[j]].b;
    const std::uint32_t part = kFirstJointPart + system.joints[j];
    const std::vector<ContactImpulse>& stored = states[system.bodies[j][0]].impulses;
    const auto at = [&](std::uint32_t feature) -> const ContactImpulse* {
      const std::array key{index_of(other), part, feature};
      const auto found = std::lower_bound(
          stored.begin(), stored.end(), key, [](const ContactImpulse& x, const auto& y) {
            return std::array{index_of(x.other), x.part, x.feature} < y;
          });
      if (found == stored.end() || found->other != other || found->part != part ||
          found->feature != feature)
        return nullptr;
      return &*found;
    };
    std::uint32_t limit = 0;
    for (std::uint32_t r = system.first_row[j]; r < system.first_row[j + 1]; ++r) {
      JointRow& row = system.rows[r];
      const bool motor = row.kind == JointRowKind::kMotor;
      const bool angular = is_angular(row);
      const bool bounded = is_bounded(row);
      const ContactImpulse* const one = at(motor ? 2 : bounded ? limit++ : angular ? 1 : 0);
      if (one == nullptr) continue;
      if (bounded)
        row.impulse_newton_s = one->normal_newton_s / row.lever_m;
      else if (angular)
        row.impulse_newton_s =
            one->friction_newton_s.dot(row.angular_b) / (row.lever_m * row.lever_m);
      else
        row.impulse_newton_s = one->friction_newton_s.dot(row.linear);
    }
  }
}

void append_joint_impulses(const SceneDescription& scene, std::uint32_t joint_place,
                           const JointSystem& system, std::vector<ContactImpulse>& out) {
  const std::uint32_t joint = system.joints[joint_place];
  std::array<ContactImpulse, 3> entries;
  for (std::uint32_t f = 0; f < entries.size(); ++f)
    entries[f] = {scene.joints[joint].b, kFirstJointPart + joint, f, 0.0, Vec3::Zero()};
  std::uint32_t limit = 0;
  for (std::uint32_t r = system.first_row[joint_place]; r < system.first_row[joint_place + 1];
       ++r) {
    const JointRow& row = system.rows[r];
    if (row.kind == JointRowKind::kMotor)
      entries[2].normal_newton_s = row.lever_m * row.impulse_newton_s;
    else if (row.kind == JointRowKind::kLimit)
      entries[limit++].normal_newton_s = row.lever_m * row.impulse_newton_s;
    else if (is_angular(row))
      entries[1].friction_newton_s += row.angular_b * row.impulse_newton_s;
    else
      entries[0].friction_newton_s += row.linear * row.impulse_newton_s;
  }
  for (const ContactImpulse& entry : entries)
    if (entry.normal_newton_s != 0.0 || entry.friction_newton_s != Vec3::Zero())
      out.push_back(entry);
}

}  // namespace soda::physics
