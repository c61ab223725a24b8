// Joints of one island by block Gauss-Seidel, within the substeps of its contacts (substeps.hpp):
// for islands whose joints take more work to factorise than to iterate over.
//
// Rows follow the poses of the substeps, errors are those of the poses and not of a linearisation.
// A substep presses joints closed as it presses overlaps apart, moves the bodies, and then takes
// out of their velocities what closed the joints.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// Three rows that hold two anchors together, solved as one block. Impulses are those on b.
struct SweptPoint {
  std::uint32_t a = 0, b = 0;  // as in JointRow
  std::uint32_t joint = 0;     // index into SceneDescription::joints
  std::uint32_t first_row = 0;
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();
  Vec3 error_m = Vec3::Zero();
  Mat3 mass_kg = Mat3::Zero();  // effective
  Vec3 impulse_newton_s = Vec3::Zero();
};

// Any other row that is solved by itself.
struct SweptRow {
  std::uint32_t row = 0;  // of the rest
  double mass_kg = 0.0;   // effective
  Vec3 twist_a = Vec3::Zero(), twist_b = Vec3::Zero();
};

// A row of the rest, and which row of the whole system it is.
struct RestRow {
  std::uint32_t row = 0, of_system = 0;
};

// The joints of an island, while a step is under way. Chains and trees take little work to
// factorise: what holds in them is solved at once (`at_once`). Else each joint by itself.
struct SweptJoints {
  const SceneDescription& scene;
  double length_s = 0.0;      // of a substep
  double part_of_step = 1.0;  // that all substeps are
  bool at_once = false;
  std::vector<BodyState> poses;    // of the bodies
  std::vector<SweptPoint> points;  // none at once
  JointSystem rest;                // the joints that are more than a point; at once: all
  std::vector<RestRow> rest_rows;  // that no point has
  std::vector<SweptRow> rows;      // of them, what is solved by itself
  // Of each row of the system: of all substeps, and of the present one what is among them.
  std::vector<double> sum_newton_s, counted_newton_s;
  Vec3 by_world_newton_s = Vec3::Zero(), by_world_newton_m_s = Vec3::Zero();  // about the origin
  double motor_work_joule = 0.0;
};

// `joints` has rows, at `states`, with the impulses of a whole step to start from.
SweptJoints swept_joints(const SceneDescription& scene, double length_s, std::uint32_t count,
                         std::span<const BodyState> states, JointSystem& joints);

// The stages of a substep, in this order. Rows at the poses there are: the bodies have what
// impulses gave in the substep before (`first`: nothing yet), and get it along the rows as they are
// now.
void follow_poses(bool first, SweptJoints& joints, std::span<SolverBody> bodies);
void press(SweptJoints& joints, std::span<SolverBody> bodies);
void move_on(std::span<const SolverBody> bodies, SweptJoints& joints);
void relax(SweptJoints& joints, std::span<SolverBody> bodies);
// Adds the impulses of the substep, or what has come to them since.
void count_impulses(std::span<const SolverBody> bodies, SweptJoints& joints);

// After the last one: the system's rows at the end of the step, with the impulses of all of it.
void end_substeps(const SweptJoints& swept, JointSystem& joints);

// The largest violation of a velocity by what holds, as the bodies move now, m/s or rad/s.
double residual_m_s(const SweptJoints& joints, std::span<const SolverBody> bodies);

}  // namespace soda::physics
