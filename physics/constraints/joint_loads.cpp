#include "physics/constraints/joint_loads.hpp"

#include <algorithm>

#include "physics/model/body_places.hpp"

namespace soda::physics {
namespace {

bool is_too_much(const SceneDescription& scene, const JointLoad& load) {
  const Joint& joint = scene.joints[load.joint];
  return load.impulse_newton_s.norm() > joint.most_force_newton * scene.dt_s ||
         load.angular_impulse_newton_m_s.norm() > joint.most_torque_newton_m * scene.dt_s;
}

void note_broken(std::uint32_t label, BodyState& state) {
  std::vector<std::uint32_t>& broken = state.broken_joints;
  broken.insert(std::ranges::lower_bound(broken, label), label);
}

}  // namespace

Need breaks_needed(const SceneDescription& scene) {
  const Need joints = joint_rows_needed(scene);
  if (!joints) return joints;
  return need_of(std::ranges::any_of(scene.joints, can_break), "a joint can break",
                 "no joint can break");
}

void add_load(const JointLoad& load, IslandReport& report) {
  std::vector<JointLoad>& loads = report.joint_loads;
  const auto place = std::ranges::lower_bound(loads, load.joint, {}, &JointLoad::joint);
  if (place == loads.end() || place->joint != load.joint) {
    loads.insert(place, load);
    return;
  }
  place->impulse_newton_s += load.impulse_newton_s;
  place->angular_impulse_newton_m_s += load.angular_impulse_newton_m_s;
}

void add_loads(const JointSystem& joints, IslandReport& report) {
  for (const std::uint32_t place : joints.breakable) {
    JointLoad load{joints.joints[place]};
    for (std::uint32_t r = joints.first_row[place]; r < joints.first_row[place + 1]; ++r) {
      const JointRow& row = joints.rows[r];
      if (row.linear == Vec3::Zero())
        load.angular_impulse_newton_m_s += row.angular_b * row.impulse_newton_s;
      else
        load.impulse_newton_s += row.linear * row.impulse_newton_s;
    }
    add_load(load, report);
  }
}

void break_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<BodyState> states, IslandReport& report, StageCounters& counters) {
  for (const JointLoad& load : report.joint_loads) {
    if (!is_too_much(scene, load)) continue;
    const Joint& joint = scene.joints[load.joint];
    note_broken(joint.label, states[place_of(ids, joint.a)]);
    if (!is_static(joint.b)) note_broken(joint.label, states[place_of(ids, joint.b)]);
    report.rests = false;
    ++counters.joints_broken;
  }
  report.joint_loads.clear();
}

}  // namespace soda::physics
