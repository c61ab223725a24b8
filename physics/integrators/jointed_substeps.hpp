// Islands that joints and contacts hold, in substeps: both among the same sweeps.
//
// A substep is one of substeps.hpp, with a block for each joint in both of its sweeps. Joints turn
// with their bodies: their rows are those of the pose at each substep's start, so that what one
// substep opens to second order the next one closes. The cost is linear in rows.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// What the substeps of a step have come to.
struct JointedMotion {
  std::vector<BodyState> states;       // poses; velocities are those of the problem's bodies
  std::vector<Vec3> flown_m;           // ways at mean velocities: what else there is is push-out
  std::vector<double> joint_newton_s;  // of the whole step, of each row
  double motor_work_joule = 0.0;
  Vec3 world_newton_s = Vec3::Zero();    // by the world, through joints
  Vec3 world_newton_m_s = Vec3::Zero();  // about the world origin
  std::uint32_t sweeps = 0;
};

// `problem` as build_rows leaves it, joints without rows. Both end with the step's impulses.
JointedMotion solve_jointed_in_substeps(const JointedStep& step, JointSystem& joints,
                                        ContactProblem& problem);

// The island after such a step; `states` are those before it. What it gains beyond the work of
// motors and forces, and beyond what pressing and closing lift, is taken from its velocities.
// Joints are closed at its end if that is `affordable`. Where that would lift more than push-out
// may, it comes less far instead. Stored impulses stay.
void take_jointed_motion(const JointedStep& step, const JointedMotion& motion, bool affordable,
                         JointSystem& joints, ContactProblem& problem, std::span<BodyState> states,
                         IslandReport& report, std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
