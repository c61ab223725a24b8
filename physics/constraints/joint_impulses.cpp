#include "physics/constraints/joint_impulses.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "physics/math/short_list.hpp"

namespace soda::physics {
namespace {

bool is_angular(const JointRow& row) { return row.linear == Vec3::Zero(); }

const Vec3& direction_of(const JointRow& row) {
  return is_angular(row) ? row.angular_b : row.linear;
}

// Impulses along the rows that add up to the sum. Those of a hinge that is turned are not quite
// orthogonal: what is light beside what it bears would feel that.
void split_sum(const Vec3& sum, std::span<JointRow* const> rows) {
  Mat3 between = Mat3::Identity();
  Vec3 along = Vec3::Zero();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    along[row] = sum.dot(direction_of(*rows[k]));
    for (std::size_t l = 0; l < rows.size(); ++l)
      between(row, static_cast<Eigen::Index>(l)) =
          direction_of(*rows[k]).dot(direction_of(*rows[l]));
  }
  const Vec3 split = between.inverse() * along;
  for (std::size_t k = 0; k < rows.size(); ++k)
    rows[k]->impulse_newton_s = split.allFinite() ? split[static_cast<Eigen::Index>(k)]
                                                  : along[static_cast<Eigen::Index>(k)];
}

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
    std::array<ShortList<JointRow*, 3>, 2> held;  // by whether they are angular
    for (std::uint32_t r = system.first_row[j]; r < system.first_row[j + 1]; ++r) {
      JointRow& row = system.rows[r];
      if (!is_bounded(row)) {
        held[is_angular(row)].push_back(&row);
        continue;
      }
      const ContactImpulse* const one = at(row.kind == JointRowKind::kMotor ? 2 : limit++);
      if (one != nullptr) row.impulse_newton_s = one->normal_newton_s;
    }
    for (const std::uint32_t feature : {0u, 1u})
      if (const ContactImpulse* const sum = at(feature))
        split_sum(sum->friction_newton_s, as_span(held[feature]));
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
      entries[2].normal_newton_s = row.impulse_newton_s;
    else if (row.kind == JointRowKind::kLimit)
      entries[limit++].normal_newton_s = row.impulse_newton_s;
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
