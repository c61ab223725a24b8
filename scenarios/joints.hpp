// From what a document says of joints to those of a scene.
#pragma once

#include <vector>

#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {

// What a motor is called in the file.
struct MotorKeys {
  const char *speed, *push, *target;
};
inline constexpr MotorKeys kHingeMotor{"motor_speed_rad_s", "motor_torque_newton_m",
                                       "motor_target_rad"};
inline constexpr MotorKeys kSliderMotor{"motor_speed_m_s", "motor_force_newton", "motor_target_m"};

// Whether the joint's limits allow b to be turned or moved as far against a.
bool are_within_limits(const physics::Joint& joint, double place);

// Of a scene whose bodies are all there. Faults: ids given twice, unknown or absent bodies, a body
// with itself, axes and distances without length.
void build_joints(const std::vector<JointSpec>& joints, Scenario& scenario, FaultList& faults);

}  // namespace soda::scenarios
