// What the solution of an island tells besides new states.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::physics {

// What a joint that can break bore: the sums of its impulses on b over the time that is reported.
struct JointLoad {
  std::uint32_t joint = 0;  // index into SceneDescription::joints
  Vec3 impulse_newton_s = Vec3::Zero();
  Vec3 angular_impulse_newton_m_s = Vec3::Zero();  // about its anchor
};

// What a solved island has to report. All of it is a function of the island's content.
struct IslandReport {
  BodyId label{};  // smallest id
  std::uint32_t bodies = 0;
  std::uint32_t contact_points = 0;
  bool direct = false;  // solved by Newton's method (contact_choice.hpp)
  bool rests = false;   // it ended as it began, bit for bit (sleeping.hpp)
  // Accuracy mode: whether the error of the step, of the worst body's width (refinement_error.hpp),
  // is more than the tolerance. Else nothing.
  bool beyond_tolerance = false;
  std::uint32_t iterations = 0;  // and steps of Newton's method
  BodyId worst_body{};
  std::uint64_t multiplications = 0;     // of its factorisations, roughly
  double max_penetration_m = 0.0;        // at the start of the step, >= 0
  double constraint_residual_m_s = 0.0;  // largest remaining violation of a velocity constraint
  double joint_error = 0.0;              // largest of its joints at the end, m
  // Energy that displacements without velocity gave: position correction of overlaps, closing of
  // joints, in substeps what the displacement differs from that of the final velocity. Not of
  // islands in blocks. What else contacts do in a step takes energy out (energy_clamp.hpp).
  double push_out_work_joule = 0.0;
  double error_estimate = 0.0;                            // accuracy mode: of the worst body
  double motor_work_joule = 0.0;                          // of motors of joints
  Vec3 static_impulse_newton_s = Vec3::Zero();            // by statics (articulated_island.hpp)
  Vec3 static_angular_impulse_newton_m_s = Vec3::Zero();  // about the world origin
  // While the step is solved: loads, ascending (joint_loads.hpp), and by how much contacts let an
  // overlap grow at most, of the smaller body, where that is looked at (end_contacts.hpp).
  std::vector<JointLoad> joint_loads;
  double overlap_growth = 0.0;
};

// A body whose new state would not be finite. It keeps its old one.
struct AdvanceFault {
  BodyId body{};
  std::string what;
};

}  // namespace soda::physics
