// What a step tells of joints (joint_motion.hpp).

#include <algorithm>

#include "physics/constraints/joint_loads.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/model/body_places.hpp"

namespace soda::physics {

void report_joints(std::span<const BodyState> states, const JointSystem& joints,
                   IslandReport& report) {
  add_loads(joints, report);
  const auto add = [&](const JointRow& row) {
    if (row.b != states.size()) return;
    report.static_impulse_newton_s -= row.linear * row.impulse_newton_s;
    report.static_angular_impulse_newton_m_s -=
        row.angular_a * row.impulse_newton_s +
        states[row.a].position_m.cross(row.linear * row.impulse_newton_s);
  };
  std::ranges::for_each(joints.rows, add);
  std::ranges::for_each(joints.dropped, add);
}

void report_lost_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds,
                        std::span<const BodyState> states, std::vector<AdvanceFault>& faults) {
  std::vector<std::uint32_t> found(ids.size() + 1, 0);
  for (const ContactManifold& manifold : manifolds) {
    if (!is_joint(manifold)) continue;
    ++found[place_of(ids, manifold.a)];
    ++found[place_of(ids, manifold.b)];
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (found[i] + states[i].broken_joints.size() < scene.bodies[index_of(ids[i])].joints)
      faults.push_back({ids[i], "is pulled farther from a joint's other body than its reach_m"});
}

}  // namespace soda::physics
