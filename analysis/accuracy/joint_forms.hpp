// Textbook motions under forces, on springs and on joints with the world. All of them may use libm:
// they judge states, they do not make them.
#pragma once

#include "analysis/accuracy/closed_forms.hpp"
#include "physics/model/joint.hpp"

namespace soda::analysis {

// v' = g + F/m - c v, and about a principal axis w' = T/I - c w. Without an attitude if spin and
// torque do not stay about one such axis.
MotionAt forced_flight(const StartingBody& body, const physics::BodyForces& forces,
                       const physics::Vec3& gravity_m_s2);

// m x'' = -k (x - l) - c x' + m g along the line from the spring's anchor in the world to the body,
// which gravity and the velocity do not leave. With friction, on a level floor, less mu m g against
// the velocity: until a swing ends where the spring is too weak to begin the next one.
MotionAt damped_oscillator(const StartingBody& body, const physics::Joint& spring,
                           const physics::Vec3& gravity_m_s2, double friction);

// A top about its fixed point, which the ball joint holds: the vertical part of its spin precesses
// it, the rest turns it about its own axis, which goes through the point.
MotionAt steady_precession(const StartingBody& body, const physics::Joint& ball,
                           const physics::Vec3& gravity_m_s2, double precession_rad_s);

// Along a slider or about a hinge with the world: evenly accelerated by gravity (sliders) and the
// motor, until the motor's speed is reached, which it keeps, or a stop, which takes all speed away.
MotionAt joint_travel(const StartingBody& body, const physics::Joint& joint,
                      const physics::Vec3& gravity_m_s2);

}  // namespace soda::analysis
